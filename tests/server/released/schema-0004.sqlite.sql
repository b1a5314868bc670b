BEGIN TRANSACTION;
CREATE TABLE alembic_version (
	version_num VARCHAR(32) NOT NULL, 
	CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num)
);
INSERT INTO "alembic_version" VALUES('0004');
CREATE TABLE api_tokens (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	user_id INTEGER NOT NULL, 
	name TEXT NOT NULL, 
	token_hash VARCHAR(64) NOT NULL, 
	prefix VARCHAR(16) NOT NULL, 
	created_at VARCHAR(32) NOT NULL, 
	expires_at VARCHAR(32), 
	last_used_at VARCHAR(32), 
	revoked_at VARCHAR(32), scope VARCHAR(8) DEFAULT 'admin' NOT NULL, 
	CONSTRAINT fk_api_tokens_user_id_users FOREIGN KEY(user_id) REFERENCES users (id), 
	CONSTRAINT uq_api_tokens_token_hash UNIQUE (token_hash)
);
INSERT INTO "api_tokens" VALUES(1,1,'SILO_API_TOKEN','aa555d5e7fd295d76f5937b31863bd0d09e9afbbfbbb7013bfdc6775be7ae073','silo','2026-11-22T06:24:05.068441Z',NULL,'2026-11-22T06:24:06.107371Z',NULL,'admin');
INSERT INTO "api_tokens" VALUES(2,1,'revoked','fe655ec2a0b9c5441e59d6822aa2ca7ebefc87094b88d1199742d340fe8dd82c','silo_91b4','2026-11-22T06:24:05.948246Z',NULL,NULL,'2026-11-22T06:24:05.954802Z','admin');
CREATE TABLE audit (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	at VARCHAR(32) NOT NULL, 
	username VARCHAR(64) NOT NULL, 
	action VARCHAR(64) NOT NULL, 
	target TEXT NOT NULL, 
	detail TEXT NOT NULL, 
	address VARCHAR(64) NOT NULL
);
INSERT INTO "audit" VALUES(1,'2026-11-22T06:24:05.068441Z','system','user.created','admin','role admin','');
INSERT INTO "audit" VALUES(2,'2026-11-22T06:24:05.068441Z','system','token.created','SILO_API_TOKEN','','');
INSERT INTO "audit" VALUES(3,'2026-11-22T06:24:05.144300Z','admin','user.created','zoe','role editor','127.0.0.1');
INSERT INTO "audit" VALUES(4,'2026-11-22T06:24:05.356898Z','admin','login_link.created','zoe','','127.0.0.1');
INSERT INTO "audit" VALUES(5,'2026-11-22T06:24:05.361446Z','admin','mode.set','normal','','127.0.0.1');
INSERT INTO "audit" VALUES(6,'2026-11-22T06:24:05.756255Z','admin','login.failed','admin','','127.0.0.1');
INSERT INTO "audit" VALUES(7,'2026-11-22T06:24:05.931649Z','zoe','login','','','127.0.0.1');
INSERT INTO "audit" VALUES(8,'2026-11-22T06:24:05.948246Z','admin','token.created','revoked','','127.0.0.1');
INSERT INTO "audit" VALUES(9,'2026-11-22T06:24:05.954802Z','admin','token.revoked','revoked','','127.0.0.1');
CREATE TABLE bom_change_lines (
	change_id INTEGER NOT NULL, 
	line_id VARCHAR(36) NOT NULL, 
	child_id INTEGER NOT NULL, 
	position INTEGER NOT NULL, 
	action VARCHAR(16) NOT NULL, 
	"before" TEXT, 
	"after" TEXT, 
	CONSTRAINT pk_bom_change_lines PRIMARY KEY (change_id, line_id), 
	CONSTRAINT fk_bom_change_lines_change_id_bom_changes FOREIGN KEY(change_id) REFERENCES bom_changes (id)
);
INSERT INTO "bom_change_lines" VALUES(1,'fccb42f8-e9ce-4621-a6b2-dc9ec9b38844',4,1,'added',NULL,'{"quantity":2.0,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(1,'9721f84a-c508-4406-a851-ae92e0da13dc',5,2,'added',NULL,'{"quantity":2.0,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(1,'9a19e957-9391-47df-b6d4-552071b39a49',1,3,'added',NULL,'{"quantity":8.0,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(2,'9721f84a-c508-4406-a851-ae92e0da13dc',5,2,'changed','{"quantity":2.0,"source":"assembly","rel_type":"component"}','{"quantity":2.0,"source":"assembly","rel_type":"component","unreferenced_since":"2026-11-22T06:24:06.109074Z"}');
INSERT INTO "bom_change_lines" VALUES(2,'9a19e957-9391-47df-b6d4-552071b39a49',1,3,'changed','{"quantity":8.0,"source":"assembly","rel_type":"component"}','{"quantity":12,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(3,'fccb42f8-e9ce-4621-a6b2-dc9ec9b38844',4,1,'changed','{"quantity":2.0,"source":"assembly","rel_type":"component"}','{"quantity":1.0,"source":"manual","rel_type":"component","override":true,"cad_quantity":2.0}');
INSERT INTO "bom_change_lines" VALUES(5,'d9a7631e-b7c3-4908-8998-dbb74b67b236',2,1,'added',NULL,'{"quantity":3.0,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(5,'281f9b6d-6dc2-4a44-a0f5-129641aa4dab',7,2,'added',NULL,'{"quantity":1.0,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(6,'983b186b-82cf-4bdb-a2c9-a234809515f6',5,3,'added',NULL,'{"quantity":0.5,"source":"manual","rel_type":"component","notes":"glue"}');
CREATE TABLE bom_changes (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	parent_id INTEGER NOT NULL, 
	version INTEGER NOT NULL, 
	kind VARCHAR(16) NOT NULL, 
	at VARCHAR(32) NOT NULL, 
	username VARCHAR(64) NOT NULL, 
	summary TEXT NOT NULL, 
	reason TEXT, 
	document_file TEXT, 
	document_sha256 VARCHAR(64), 
	document_revision INTEGER, 
	sync_id VARCHAR(128), 
	refers_to INTEGER, 
	decisions TEXT, 
	CONSTRAINT fk_bom_changes_parent_id_items FOREIGN KEY(parent_id) REFERENCES items (id)
);
INSERT INTO "bom_changes" VALUES(1,2,1,'merge','2026-11-22T06:24:06.088871Z','admin','BOM updated: 3 added, 0 quantity changed, 0 unreferenced',NULL,NULL,NULL,NULL,'first',NULL,NULL);
INSERT INTO "bom_changes" VALUES(2,2,2,'merge','2026-11-22T06:24:06.109074Z','admin','BOM updated: 0 added, 1 quantity changed, 1 unreferenced',NULL,NULL,NULL,NULL,'second',NULL,NULL);
INSERT INTO "bom_changes" VALUES(3,2,3,'edit','2026-11-22T06:24:06.122139Z','admin','PRT-100 changed: quantity 2 → 1',NULL,NULL,NULL,NULL,NULL,NULL,NULL);
INSERT INTO "bom_changes" VALUES(4,2,3,'merge','2026-11-22T06:24:06.128980Z','admin','BOM updated: 0 added, 0 quantity changed, 1 unreferenced, 1 in conflict',NULL,NULL,NULL,NULL,'third',NULL,NULL);
INSERT INTO "bom_changes" VALUES(5,3,1,'merge','2026-11-22T06:24:06.137178Z','admin','BOM updated: 2 added, 0 quantity changed, 0 unreferenced',NULL,NULL,NULL,NULL,NULL,NULL,NULL);
INSERT INTO "bom_changes" VALUES(6,3,2,'edit','2026-11-22T06:24:06.143994Z','admin','PRT-400 added, quantity 0.5',NULL,NULL,NULL,NULL,NULL,NULL,NULL);
CREATE TABLE bom_conflicts (
	parent_id INTEGER NOT NULL, 
	child_id INTEGER NOT NULL, 
	cad_quantity FLOAT NOT NULL, 
	since VARCHAR(32) NOT NULL, 
	accepted BOOLEAN NOT NULL, 
	CONSTRAINT pk_bom_conflicts PRIMARY KEY (parent_id, child_id), 
	CONSTRAINT fk_bom_conflicts_child_id_items FOREIGN KEY(child_id) REFERENCES items (id), 
	CONSTRAINT fk_bom_conflicts_parent_id_items FOREIGN KEY(parent_id) REFERENCES items (id)
);
INSERT INTO "bom_conflicts" VALUES(2,4,2.0,'2026-11-22T06:24:06.128980Z',0);
CREATE TABLE bom_last_syncs (
	parent_id INTEGER NOT NULL, 
	at VARCHAR(32), 
	username VARCHAR(64) NOT NULL, 
	document_file TEXT, 
	left_out TEXT NOT NULL, 
	components TEXT NOT NULL, 
	refused_at VARCHAR(32), 
	refusal TEXT, 
	CONSTRAINT pk_bom_last_syncs PRIMARY KEY (parent_id), 
	CONSTRAINT fk_bom_last_syncs_parent_id_items FOREIGN KEY(parent_id) REFERENCES items (id)
);
INSERT INTO "bom_last_syncs" VALUES(2,'2026-11-22T06:24:06.128980Z','admin',NULL,'[]','{}',NULL,NULL);
INSERT INTO "bom_last_syncs" VALUES(3,'2026-11-22T06:24:06.137178Z','admin',NULL,'[{"reason":"missing","name":"Lid","file":"parts/Lid.FCStd","quantity":2}]','{}',NULL,NULL);
CREATE TABLE bom_lines (
	id VARCHAR(36) NOT NULL, 
	parent_id INTEGER NOT NULL, 
	child_id INTEGER NOT NULL, 
	position INTEGER NOT NULL, 
	rel_type VARCHAR(16) NOT NULL, 
	quantity FLOAT NOT NULL, 
	unit VARCHAR(32), 
	reference_designators TEXT NOT NULL, 
	find_number VARCHAR(32), 
	notes TEXT, 
	child_revision INTEGER, 
	source VARCHAR(16) NOT NULL, 
	unreferenced_since VARCHAR(32), 
	override BOOLEAN NOT NULL, 
	cad_quantity FLOAT, 
	reason TEXT, 
	metadata TEXT NOT NULL, 
	CONSTRAINT pk_bom_lines PRIMARY KEY (id), 
	CONSTRAINT fk_bom_lines_child_id_items FOREIGN KEY(child_id) REFERENCES items (id), 
	CONSTRAINT fk_bom_lines_parent_id_items FOREIGN KEY(parent_id) REFERENCES items (id), 
	CONSTRAINT uq_bom_lines_parent_id_child_id_rel_type UNIQUE (parent_id, child_id, rel_type)
);
INSERT INTO "bom_lines" VALUES('fccb42f8-e9ce-4621-a6b2-dc9ec9b38844',2,4,1,'component',1.0,NULL,'[]',NULL,NULL,NULL,'manual',NULL,1,2.0,NULL,'{}');
INSERT INTO "bom_lines" VALUES('9721f84a-c508-4406-a851-ae92e0da13dc',2,5,2,'component',2.0,NULL,'[]',NULL,NULL,NULL,'assembly','2026-11-22T06:24:06.109074Z',0,NULL,NULL,'{}');
INSERT INTO "bom_lines" VALUES('9a19e957-9391-47df-b6d4-552071b39a49',2,1,3,'component',12.0,NULL,'[]',NULL,NULL,NULL,'assembly',NULL,0,NULL,NULL,'{}');
INSERT INTO "bom_lines" VALUES('d9a7631e-b7c3-4908-8998-dbb74b67b236',3,2,1,'component',3.0,NULL,'[]',NULL,NULL,NULL,'assembly',NULL,0,NULL,NULL,'{}');
INSERT INTO "bom_lines" VALUES('281f9b6d-6dc2-4a44-a0f5-129641aa4dab',3,7,2,'component',1.0,NULL,'[]',NULL,NULL,NULL,'assembly',NULL,0,NULL,NULL,'{}');
INSERT INTO "bom_lines" VALUES('983b186b-82cf-4bdb-a2c9-a234809515f6',3,5,3,'component',0.5,NULL,'[]',NULL,'glue',NULL,'manual',NULL,0,NULL,NULL,'{}');
CREATE TABLE bom_syncs (
	parent_id INTEGER NOT NULL, 
	sync_id VARCHAR(128) NOT NULL, 
	request_hash VARCHAR(64) NOT NULL, 
	answer TEXT NOT NULL, 
	version INTEGER NOT NULL, 
	at VARCHAR(32) NOT NULL, change_id INTEGER, 
	CONSTRAINT pk_bom_syncs PRIMARY KEY (parent_id, sync_id), 
	CONSTRAINT fk_bom_syncs_parent_id_items FOREIGN KEY(parent_id) REFERENCES items (id)
);
INSERT INTO "bom_syncs" VALUES(2,'first','d85e62493761392e879d128144fe5095f6944d6ceadf1e729eb8fa7df3d29577','{"status":"merged","diff":{"added":[{"part_number":"PRT-100","quantity":2},{"part_number":"PRT-400","quantity":2},{"part_number":"F01-0001","quantity":8}],"removed":[],"quantity_changed":[],"unchanged":[]},"warnings":[],"resolve_url":"/items/ASM-001/bom","sync_id":"first"}',1,'2026-11-22T06:24:06.088871Z',NULL);
INSERT INTO "bom_syncs" VALUES(2,'second','f6f75943662441d433c757c94063a40292b89f8d0a46825edabbc7ea1ec13c50','{"status":"merged","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[{"part_number":"F01-0001","old_quantity":8,"new_quantity":12}],"unchanged":[{"part_number":"PRT-100","quantity":2}]},"warnings":[{"type":"unreferenced","part_number":"PRT-400","message":"Present in server BOM but not in assembly"}],"resolve_url":"/items/ASM-001/bom","sync_id":"second"}',2,'2026-11-22T06:24:06.109074Z',NULL);
INSERT INTO "bom_syncs" VALUES(2,'third','f6f75943662441d433c757c94063a40292b89f8d0a46825edabbc7ea1ec13c50','{"status":"merged","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[],"unchanged":[{"part_number":"F01-0001","quantity":12}]},"warnings":[{"type":"unreferenced","part_number":"PRT-400","message":"Present in server BOM but not in assembly"},{"type":"conflict","part_number":"PRT-100","message":"The assembly has 2, Silo has 1 (set by a person); a person decides","assembly_quantity":2,"server_quantity":1}],"resolve_url":"/items/ASM-001/bom","sync_id":"third"}',3,'2026-11-22T06:24:06.128980Z',NULL);
CREATE TABLE events (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	name VARCHAR(64) NOT NULL, 
	item_uuid VARCHAR(36), 
	part_number_key VARCHAR(64), 
	data TEXT NOT NULL, 
	at VARCHAR(32) NOT NULL
);
INSERT INTO "events" VALUES(1,'server.state',NULL,NULL,'{"mode":"normal"}','2026-11-22T06:24:05.361446Z');
INSERT INTO "events" VALUES(2,'item.created','bd78e542-3dbc-435e-8f90-284e268b5225','f01-0001','{"part_number":"F01-0001","id":"bd78e542-3dbc-435e-8f90-284e268b5225","name":"Screw M4","description":"Screw M4","item_type":"part"}','2026-11-22T06:24:05.980251Z');
INSERT INTO "events" VALUES(3,'revision.created','877c40a4-46ad-4cd0-b5a0-7a9018d3da9b','asm-001','{"part_number":"ASM-001","id":"877c40a4-46ad-4cd0-b5a0-7a9018d3da9b","revision_number":1,"comment":"created","user":"admin"}','2026-11-22T06:24:05.999066Z');
INSERT INTO "events" VALUES(4,'item.created','877c40a4-46ad-4cd0-b5a0-7a9018d3da9b','asm-001','{"part_number":"ASM-001","id":"877c40a4-46ad-4cd0-b5a0-7a9018d3da9b","name":"ASM-001","description":"of ASM-001","item_type":"assembly"}','2026-11-22T06:24:05.999066Z');
INSERT INTO "events" VALUES(5,'revision.created','a1d59b89-99fa-4fe2-8949-7948d74df223','asm-top','{"part_number":"ASM-TOP","id":"a1d59b89-99fa-4fe2-8949-7948d74df223","revision_number":1,"comment":"created","user":"admin"}','2026-11-22T06:24:06.006124Z');
INSERT INTO "events" VALUES(6,'item.created','a1d59b89-99fa-4fe2-8949-7948d74df223','asm-top','{"part_number":"ASM-TOP","id":"a1d59b89-99fa-4fe2-8949-7948d74df223","name":"ASM-TOP","description":"of ASM-TOP","item_type":"assembly"}','2026-11-22T06:24:06.006124Z');
INSERT INTO "events" VALUES(7,'revision.created','c4e77d45-764d-4603-bdb2-b0c8dc09cb51','prt-100','{"part_number":"PRT-100","id":"c4e77d45-764d-4603-bdb2-b0c8dc09cb51","revision_number":1,"comment":"created","user":"admin"}','2026-11-22T06:24:06.010075Z');
INSERT INTO "events" VALUES(8,'item.created','c4e77d45-764d-4603-bdb2-b0c8dc09cb51','prt-100','{"part_number":"PRT-100","id":"c4e77d45-764d-4603-bdb2-b0c8dc09cb51","name":"PRT-100","description":"of PRT-100","item_type":"part"}','2026-11-22T06:24:06.010075Z');
INSERT INTO "events" VALUES(9,'revision.created','caaf2bcd-4728-4832-97e5-71a77fdddaf1','prt-400','{"part_number":"PRT-400","id":"caaf2bcd-4728-4832-97e5-71a77fdddaf1","revision_number":1,"comment":"created","user":"admin"}','2026-11-22T06:24:06.023837Z');
INSERT INTO "events" VALUES(10,'item.created','caaf2bcd-4728-4832-97e5-71a77fdddaf1','prt-400','{"part_number":"PRT-400","id":"caaf2bcd-4728-4832-97e5-71a77fdddaf1","name":"PRT-400","description":"of PRT-400","item_type":"part"}','2026-11-22T06:24:06.023837Z');
INSERT INTO "events" VALUES(11,'revision.created','217f3f41-cdd8-41f0-95a6-bf6f119154cc','prt-500','{"part_number":"PRT-500","id":"217f3f41-cdd8-41f0-95a6-bf6f119154cc","revision_number":1,"comment":"created","user":"admin"}','2026-11-22T06:24:06.032075Z');
INSERT INTO "events" VALUES(12,'item.created','217f3f41-cdd8-41f0-95a6-bf6f119154cc','prt-500','{"part_number":"PRT-500","id":"217f3f41-cdd8-41f0-95a6-bf6f119154cc","name":"PRT-500","description":"of PRT-500","item_type":"part"}','2026-11-22T06:24:06.032075Z');
INSERT INTO "events" VALUES(13,'revision.created','17d9fabc-6088-4cf6-892c-9ea31410102e','ünïcode-7','{"part_number":"Ünïcode-7","id":"17d9fabc-6088-4cf6-892c-9ea31410102e","revision_number":1,"comment":"created","user":"admin"}','2026-11-22T06:24:06.038042Z');
INSERT INTO "events" VALUES(14,'item.created','17d9fabc-6088-4cf6-892c-9ea31410102e','ünïcode-7','{"part_number":"Ünïcode-7","id":"17d9fabc-6088-4cf6-892c-9ea31410102e","name":"Ünïcode-7","description":"of Ünïcode-7","item_type":"part"}','2026-11-22T06:24:06.038042Z');
INSERT INTO "events" VALUES(15,'item.deleted','217f3f41-cdd8-41f0-95a6-bf6f119154cc','prt-500','{"part_number":"PRT-500","id":"217f3f41-cdd8-41f0-95a6-bf6f119154cc"}','2026-11-22T06:24:06.046320Z');
INSERT INTO "events" VALUES(16,'bom_merge','877c40a4-46ad-4cd0-b5a0-7a9018d3da9b','asm-001','{"type":"bom_merge","item":"ASM-001","user":"admin","timestamp":"2026-11-22T06:24:06Z","summary":"BOM updated: 3 added, 0 quantity changed, 0 unreferenced","diff":{"added":[{"part_number":"PRT-100","quantity":2},{"part_number":"PRT-400","quantity":2},{"part_number":"F01-0001","quantity":8}],"removed":[],"quantity_changed":[],"unchanged":[]},"resolve_url":"/items/ASM-001/bom","sync_id":"first"}','2026-11-22T06:24:06.088871Z');
INSERT INTO "events" VALUES(17,'bom_merge','877c40a4-46ad-4cd0-b5a0-7a9018d3da9b','asm-001','{"type":"bom_merge","item":"ASM-001","user":"admin","timestamp":"2026-11-22T06:24:06Z","summary":"BOM updated: 0 added, 1 quantity changed, 1 unreferenced","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[{"part_number":"F01-0001","old_quantity":8,"new_quantity":12}],"unchanged":[{"part_number":"PRT-100","quantity":2}]},"resolve_url":"/items/ASM-001/bom","sync_id":"second"}','2026-11-22T06:24:06.109074Z');
INSERT INTO "events" VALUES(18,'bom.updated','877c40a4-46ad-4cd0-b5a0-7a9018d3da9b','asm-001','{"item":"ASM-001","kind":"edit","user":"admin","timestamp":"2026-11-22T06:24:06Z","summary":"PRT-100 changed: quantity 2 → 1"}','2026-11-22T06:24:06.122139Z');
INSERT INTO "events" VALUES(19,'bom_merge','877c40a4-46ad-4cd0-b5a0-7a9018d3da9b','asm-001','{"type":"bom_merge","item":"ASM-001","user":"admin","timestamp":"2026-11-22T06:24:06Z","summary":"BOM updated: 0 added, 0 quantity changed, 1 unreferenced, 1 in conflict","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[],"unchanged":[{"part_number":"F01-0001","quantity":12}]},"resolve_url":"/items/ASM-001/bom","sync_id":"third","warnings":[{"type":"unreferenced","part_number":"PRT-400","message":"Present in server BOM but not in assembly"},{"type":"conflict","part_number":"PRT-100","message":"The assembly has 2, Silo has 1 (set by a person); a person decides","assembly_quantity":2,"server_quantity":1}]}','2026-11-22T06:24:06.128980Z');
INSERT INTO "events" VALUES(20,'bom_merge','a1d59b89-99fa-4fe2-8949-7948d74df223','asm-top','{"type":"bom_merge","item":"ASM-TOP","user":"admin","timestamp":"2026-11-22T06:24:06Z","summary":"BOM updated: 2 added, 0 quantity changed, 0 unreferenced","diff":{"added":[{"part_number":"ASM-001","quantity":3},{"part_number":"Ünïcode-7","quantity":1}],"removed":[],"quantity_changed":[],"unchanged":[]},"resolve_url":"/items/ASM-TOP/bom","left_out":[{"reason":"missing","name":"Lid","file":"parts/Lid.FCStd","quantity":2}]}','2026-11-22T06:24:06.137178Z');
INSERT INTO "events" VALUES(21,'bom.updated','a1d59b89-99fa-4fe2-8949-7948d74df223','asm-top','{"item":"ASM-TOP","kind":"edit","user":"admin","timestamp":"2026-11-22T06:24:06Z","summary":"PRT-400 added, quantity 0.5"}','2026-11-22T06:24:06.143994Z');
INSERT INTO "events" VALUES(22,'revision.created','c4e77d45-764d-4603-bdb2-b0c8dc09cb51','prt-100','{"part_number":"PRT-100","id":"c4e77d45-764d-4603-bdb2-b0c8dc09cb51","revision_number":2,"comment":"as built","user":"admin"}','2026-11-22T06:24:06.157791Z');
INSERT INTO "events" VALUES(23,'revision.created','877c40a4-46ad-4cd0-b5a0-7a9018d3da9b','asm-001','{"part_number":"ASM-001","id":"877c40a4-46ad-4cd0-b5a0-7a9018d3da9b","revision_number":2,"comment":"as built","user":"admin"}','2026-11-22T06:24:06.165666Z');
CREATE TABLE "items" (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	uuid VARCHAR(36) NOT NULL, 
	part_number VARCHAR(64) NOT NULL, 
	part_number_key VARCHAR(64) NOT NULL, 
	schema_name VARCHAR(64), 
	category VARCHAR(32), 
	item_type VARCHAR(32) NOT NULL, 
	name TEXT NOT NULL, 
	description TEXT NOT NULL, 
	sourcing_type VARCHAR(64), 
	long_description TEXT, 
	thumbnail_key VARCHAR(64), 
	properties TEXT NOT NULL, 
	current_revision INTEGER NOT NULL, 
	bom_version INTEGER NOT NULL, 
	created_at VARCHAR(32) NOT NULL, 
	created_by VARCHAR(64) NOT NULL, 
	updated_at VARCHAR(32) NOT NULL, 
	updated_by VARCHAR(64) NOT NULL, 
	archived_at VARCHAR(32), version INTEGER DEFAULT '1' NOT NULL, created_as VARCHAR(64), 
	CONSTRAINT uq_items_uuid UNIQUE (uuid), 
	CONSTRAINT uq_items_part_number_key UNIQUE (part_number_key)
);
INSERT INTO "items" VALUES(1,'bd78e542-3dbc-435e-8f90-284e268b5225','F01-0001','f01-0001','kindred-rd','F01','part','Screw M4','Screw M4',NULL,NULL,NULL,'{}',0,0,'2026-11-22T06:24:05.980251Z','admin','2026-11-22T06:24:05.980251Z','admin',NULL,1,NULL);
INSERT INTO "items" VALUES(2,'877c40a4-46ad-4cd0-b5a0-7a9018d3da9b','ASM-001','asm-001','kindred-rd',NULL,'assembly','ASM-001','of ASM-001',NULL,NULL,'93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456','{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}',2,3,'2026-11-22T06:24:05.999066Z','admin','2026-11-22T06:24:06.165666Z','admin',NULL,3,'asm-001');
INSERT INTO "items" VALUES(3,'a1d59b89-99fa-4fe2-8949-7948d74df223','ASM-TOP','asm-top','kindred-rd',NULL,'assembly','ASM-TOP','of ASM-TOP',NULL,NULL,NULL,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}',1,2,'2026-11-22T06:24:06.006124Z','admin','2026-11-22T06:24:06.006124Z','admin',NULL,2,'asm-top');
INSERT INTO "items" VALUES(4,'c4e77d45-764d-4603-bdb2-b0c8dc09cb51','PRT-100','prt-100','kindred-rd',NULL,'part','PRT-100','of PRT-100',NULL,NULL,'93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456','{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}',2,0,'2026-11-22T06:24:06.010075Z','admin','2026-11-22T06:24:06.157791Z','admin',NULL,3,'prt-100');
INSERT INTO "items" VALUES(5,'caaf2bcd-4728-4832-97e5-71a77fdddaf1','PRT-400','prt-400','kindred-rd',NULL,'part','PRT-400','of PRT-400',NULL,NULL,NULL,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}',1,0,'2026-11-22T06:24:06.023837Z','admin','2026-11-22T06:24:06.023837Z','admin',NULL,2,'prt-400');
INSERT INTO "items" VALUES(6,'217f3f41-cdd8-41f0-95a6-bf6f119154cc','PRT-500','prt-500','kindred-rd',NULL,'part','PRT-500','of PRT-500',NULL,NULL,NULL,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}',1,0,'2026-11-22T06:24:06.032075Z','admin','2026-11-22T06:24:06.032075Z','admin','2026-11-22T06:24:06.046320Z',3,'prt-500');
INSERT INTO "items" VALUES(7,'17d9fabc-6088-4cf6-892c-9ea31410102e','Ünïcode-7','ünïcode-7','kindred-rd',NULL,'part','Ünïcode-7','of Ünïcode-7',NULL,NULL,NULL,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}',1,0,'2026-11-22T06:24:06.038042Z','admin','2026-11-22T06:24:06.038042Z','admin',NULL,2,'ünïcode-7');
CREATE TABLE login_failures (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	username_key VARCHAR(64) NOT NULL, 
	address VARCHAR(64) NOT NULL, 
	at VARCHAR(32) NOT NULL
);
INSERT INTO "login_failures" VALUES(1,'admin','127.0.0.1','2026-11-22T06:24:05.371934Z');
CREATE TABLE login_links (
	token_hash VARCHAR(64) NOT NULL, 
	user_id INTEGER NOT NULL, 
	expires_at VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_login_links PRIMARY KEY (token_hash), 
	CONSTRAINT fk_login_links_user_id_users FOREIGN KEY(user_id) REFERENCES users (id)
);
INSERT INTO "login_links" VALUES('52e291b94ebf245b54a620c0a6332ae218f2ca2a8b9ddc2f6fa79a75c4b520b1',1,'2026-11-22T07:24:05.068441Z');
INSERT INTO "login_links" VALUES('12f1ea0f79b922c9d57866811439d985d6d4a873c0d8a77c94864d8daa1e3dc5',2,'2026-11-22T07:24:05.356898Z');
CREATE TABLE number_counters (
	schema_name VARCHAR(64) NOT NULL, 
	category VARCHAR(32) NOT NULL, 
	last_serial INTEGER NOT NULL, 
	CONSTRAINT pk_number_counters PRIMARY KEY (schema_name, category)
);
INSERT INTO "number_counters" VALUES('kindred-rd','F01',1);
CREATE TABLE revisions (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	item_id INTEGER NOT NULL, 
	revision_number INTEGER NOT NULL, 
	properties TEXT NOT NULL, 
	comment TEXT NOT NULL, 
	status VARCHAR(16) NOT NULL, 
	file_name TEXT, 
	file_checksum VARCHAR(64), 
	file_size BIGINT, 
	thumbnail_key VARCHAR(64), 
	idempotency_key VARCHAR(128), 
	created_at VARCHAR(32) NOT NULL, 
	created_by VARCHAR(64) NOT NULL, 
	CONSTRAINT fk_revisions_item_id_items FOREIGN KEY(item_id) REFERENCES items (id), 
	CONSTRAINT uq_revisions_item_id_idempotency_key UNIQUE (item_id, idempotency_key), 
	CONSTRAINT uq_revisions_item_id_revision_number UNIQUE (item_id, revision_number)
);
INSERT INTO "revisions" VALUES(1,2,1,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','created','draft',NULL,NULL,NULL,NULL,NULL,'2026-11-22T06:24:05.999066Z','admin');
INSERT INTO "revisions" VALUES(2,3,1,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','created','draft',NULL,NULL,NULL,NULL,NULL,'2026-11-22T06:24:06.006124Z','admin');
INSERT INTO "revisions" VALUES(3,4,1,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','created','draft',NULL,NULL,NULL,NULL,NULL,'2026-11-22T06:24:06.010075Z','admin');
INSERT INTO "revisions" VALUES(4,5,1,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','created','draft',NULL,NULL,NULL,NULL,NULL,'2026-11-22T06:24:06.023837Z','admin');
INSERT INTO "revisions" VALUES(5,6,1,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','created','draft',NULL,NULL,NULL,NULL,NULL,'2026-11-22T06:24:06.032075Z','admin');
INSERT INTO "revisions" VALUES(6,7,1,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','created','draft',NULL,NULL,NULL,NULL,NULL,'2026-11-22T06:24:06.038042Z','admin');
INSERT INTO "revisions" VALUES(7,4,2,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','as built','draft','gear.FCStd','0243680c42cd5230ec6f35347bb7c1c84dcf3ed549bb030eaee73cf7dec17ad3',305,'93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456','k1','2026-11-22T06:24:06.157791Z','admin');
INSERT INTO "revisions" VALUES(8,2,2,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','as built','draft','gear.FCStd','0243680c42cd5230ec6f35347bb7c1c84dcf3ed549bb030eaee73cf7dec17ad3',305,'93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456','k1','2026-11-22T06:24:06.165666Z','admin');
CREATE TABLE server_state (
	"key" VARCHAR(64) NOT NULL, 
	value TEXT NOT NULL, 
	CONSTRAINT pk_server_state PRIMARY KEY ("key")
);
INSERT INTO "server_state" VALUES('search_index','1');
INSERT INTO "server_state" VALUES('housekeeping_of_files','1795328645.083575');
INSERT INTO "server_state" VALUES('housekeeping','{"at":"2026-11-22T06:24:05.078672Z","seconds":0.006,"removed":{},"problem":null}');
INSERT INTO "server_state" VALUES('mode','normal');
CREATE TABLE sessions (
	id_hash VARCHAR(64) NOT NULL, 
	user_id INTEGER NOT NULL, 
	csrf_token VARCHAR(64) NOT NULL, 
	created_at VARCHAR(32) NOT NULL, 
	expires_at VARCHAR(32) NOT NULL, by_link BOOLEAN DEFAULT 0 NOT NULL, 
	CONSTRAINT pk_sessions PRIMARY KEY (id_hash), 
	CONSTRAINT fk_sessions_user_id_users FOREIGN KEY(user_id) REFERENCES users (id)
);
INSERT INTO "sessions" VALUES('2dd5f96272f5a88ada94bd61c4b379415ae97a748420e3f57c7dfede34220712',2,'dx2pRVpPEVCKuQOdlsZVpAZwTwuXf2p31Ru7u0XApbA','2026-11-22T06:24:05.931649Z','2026-11-23T06:24:05.931649Z',0);
CREATE TABLE users (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	username VARCHAR(64) NOT NULL, 
	username_key VARCHAR(64) NOT NULL, 
	display_name TEXT NOT NULL, 
	role VARCHAR(16) NOT NULL, 
	password_hash TEXT, 
	active BOOLEAN NOT NULL, 
	created_at VARCHAR(32) NOT NULL, 
	CONSTRAINT uq_users_username_key UNIQUE (username_key)
);
INSERT INTO "users" VALUES(1,'admin','admin','admin','admin',NULL,1,'2026-11-22T06:24:05.068441Z');
INSERT INTO "users" VALUES(2,'zoe','zoe','zoe','editor','$argon2id$v=19$m=65536,t=3,p=4$t2OjprVc6Ktfrsvy7FPBlQ$zKLsu1iYids1yIcvaLueGJBoDO8RuXqPyzxsGdXoy44',1,'2026-11-22T06:24:05.144300Z');
CREATE INDEX ix_login_failures_address_at ON login_failures (address, at);
CREATE INDEX ix_login_failures_username_key_at ON login_failures (username_key, at);
CREATE INDEX ix_api_tokens_user_id ON api_tokens (user_id);
CREATE INDEX ix_bom_changes_parent_id_id ON bom_changes (parent_id, id);
CREATE INDEX ix_bom_lines_child_id ON bom_lines (child_id);
CREATE INDEX ix_bom_syncs_at ON bom_syncs (at);
CREATE INDEX ix_revisions_file_checksum ON revisions (file_checksum);
CREATE INDEX ix_sessions_user_id ON sessions (user_id);
CREATE INDEX ix_items_archived_at_part_number_key ON items (archived_at, part_number_key);
CREATE INDEX ix_items_item_type_archived_at_part_number_key ON items (item_type, archived_at, part_number_key);
CREATE INDEX ix_items_category_archived_at_part_number_key ON items (category, archived_at, part_number_key);
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('items',7);
INSERT INTO "sqlite_sequence" VALUES('users',2);
INSERT INTO "sqlite_sequence" VALUES('audit',9);
INSERT INTO "sqlite_sequence" VALUES('api_tokens',2);
INSERT INTO "sqlite_sequence" VALUES('events',23);
INSERT INTO "sqlite_sequence" VALUES('login_failures',2);
INSERT INTO "sqlite_sequence" VALUES('revisions',8);
INSERT INTO "sqlite_sequence" VALUES('bom_changes',6);
CREATE VIRTUAL TABLE item_search USING fts5(number, name, other, detail=column, columnsize=0, prefix='2 3 4', tokenize="unicode61 remove_diacritics 0 categories 'L* N* Co Cn'");
INSERT INTO item_search (rowid, number, name, other) VALUES(1, '0001 001 010001 10001 f01 f010001', 'crew m4 rew screw', 'm4 screw screwm4');
INSERT INTO item_search (rowid, number, name, other) VALUES(2, '001 asm asm001 m001 sm001', '001 asm', '001 acme asm fcstd gear of ofasm001 стaль');
INSERT INTO item_search (rowid, number, name, other) VALUES(3, 'asm asmtop mtop smtop top', 'asm top', 'acme asm of top стaль');
INSERT INTO item_search (rowid, number, name, other) VALUES(4, '100 prt prt100 rt100 t100', '100 prt', '100 acme fcstd gear of ofprt100 prt стaль');
INSERT INTO item_search (rowid, number, name, other) VALUES(5, '400 prt prt400 rt400 t400', '400 prt', '400 acme of ofprt400 prt стaль');
INSERT INTO item_search (rowid, number, name, other) VALUES(6, '500 prt prt500 rt500 t500', '500 prt', '500 acme of ofprt500 prt стaль');
INSERT INTO item_search (rowid, number, name, other) VALUES(7, '7 code code7 de7 icode icode7 nicode nicode7 ode ode7 unicode unicode7', '7 code icode nicode ode unicode', '7 acme of ofunicode7 unicode стaль');
COMMIT;
