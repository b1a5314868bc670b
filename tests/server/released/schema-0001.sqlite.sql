BEGIN TRANSACTION;
CREATE TABLE alembic_version (
	version_num VARCHAR(32) NOT NULL, 
	CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num)
);
INSERT INTO "alembic_version" VALUES('0001');
CREATE TABLE api_tokens (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	user_id INTEGER NOT NULL, 
	name TEXT NOT NULL, 
	token_hash VARCHAR(64) NOT NULL, 
	prefix VARCHAR(16) NOT NULL, 
	created_at VARCHAR(32) NOT NULL, 
	expires_at VARCHAR(32), 
	last_used_at VARCHAR(32), 
	revoked_at VARCHAR(32), 
	CONSTRAINT fk_api_tokens_user_id_users FOREIGN KEY(user_id) REFERENCES users (id), 
	CONSTRAINT uq_api_tokens_token_hash UNIQUE (token_hash)
);
INSERT INTO "api_tokens" VALUES(1,1,'SILO_API_TOKEN','aa555d5e7fd295d76f5937b31863bd0d09e9afbbfbbb7013bfdc6775be7ae073','silo_rele','2026-11-22T02:52:51.330459Z',NULL,'2026-11-22T02:52:51.405405Z',NULL);
INSERT INTO "api_tokens" VALUES(2,1,'revoked','baf738141c35513ea7f5181464b8e8f10c8a514006305e02dea3acf643847002','silo_6231','2026-11-22T02:52:51.868734Z',NULL,NULL,'2026-11-22T02:52:51.874555Z');
CREATE TABLE audit (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	at VARCHAR(32) NOT NULL, 
	username VARCHAR(64) NOT NULL, 
	action VARCHAR(64) NOT NULL, 
	target TEXT NOT NULL, 
	detail TEXT NOT NULL, 
	address VARCHAR(64) NOT NULL
);
INSERT INTO "audit" VALUES(1,'2026-11-22T02:52:51.330459Z','system','user.created','admin','role admin','');
INSERT INTO "audit" VALUES(2,'2026-11-22T02:52:51.330459Z','system','token.created','SILO_API_TOKEN','','');
INSERT INTO "audit" VALUES(3,'2026-11-22T02:52:51.407999Z','admin','user.created','zoe','role editor','127.0.0.1');
INSERT INTO "audit" VALUES(4,'2026-11-22T02:52:51.529582Z','admin','login_link.created','zoe','','127.0.0.1');
INSERT INTO "audit" VALUES(5,'2026-11-22T02:52:51.534568Z','admin','mode.set','normal','','127.0.0.1');
INSERT INTO "audit" VALUES(6,'2026-11-22T02:52:51.750631Z','admin','login.failed','admin','','127.0.0.1');
INSERT INTO "audit" VALUES(7,'2026-11-22T02:52:51.862820Z','zoe','login','','','127.0.0.1');
INSERT INTO "audit" VALUES(8,'2026-11-22T02:52:51.868734Z','admin','token.created','revoked','','127.0.0.1');
INSERT INTO "audit" VALUES(9,'2026-11-22T02:52:51.874555Z','admin','token.revoked','revoked','','127.0.0.1');
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
INSERT INTO "bom_change_lines" VALUES(1,'75181b77-7d7f-46da-acbe-a12775bd2473',4,1,'added',NULL,'{"quantity":2.0,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(1,'94d8e9b0-fe88-4358-b268-e667343ab4a4',5,2,'added',NULL,'{"quantity":2.0,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(1,'b2647219-0b8b-4521-8f0e-6e2fd69bedf6',1,3,'added',NULL,'{"quantity":8.0,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(2,'94d8e9b0-fe88-4358-b268-e667343ab4a4',5,2,'changed','{"quantity":2.0,"source":"assembly","rel_type":"component"}','{"quantity":2.0,"source":"assembly","rel_type":"component","unreferenced_since":"2026-11-22T02:52:51.990012Z"}');
INSERT INTO "bom_change_lines" VALUES(2,'b2647219-0b8b-4521-8f0e-6e2fd69bedf6',1,3,'changed','{"quantity":8.0,"source":"assembly","rel_type":"component"}','{"quantity":12,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(3,'75181b77-7d7f-46da-acbe-a12775bd2473',4,1,'changed','{"quantity":2.0,"source":"assembly","rel_type":"component"}','{"quantity":1.0,"source":"manual","rel_type":"component","override":true,"cad_quantity":2.0}');
INSERT INTO "bom_change_lines" VALUES(5,'33e5390b-dd91-47f5-bc33-df93512f65f7',2,1,'added',NULL,'{"quantity":3.0,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(5,'cb7caaf4-cbd2-4ea6-b881-c5e787fd2191',7,2,'added',NULL,'{"quantity":1.0,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(6,'64d93936-f5d9-43e6-9c94-aa200a46bda7',5,3,'added',NULL,'{"quantity":0.5,"source":"manual","rel_type":"component","notes":"glue"}');
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
INSERT INTO "bom_changes" VALUES(1,2,1,'merge','2026-11-22T02:52:51.975265Z','admin','BOM updated: 3 added, 0 quantity changed, 0 unreferenced',NULL,NULL,NULL,NULL,'first',NULL,NULL);
INSERT INTO "bom_changes" VALUES(2,2,2,'merge','2026-11-22T02:52:51.990012Z','admin','BOM updated: 0 added, 1 quantity changed, 1 unreferenced',NULL,NULL,NULL,NULL,'second',NULL,NULL);
INSERT INTO "bom_changes" VALUES(3,2,3,'edit','2026-11-22T02:52:51.998310Z','admin','PRT-100 changed: quantity 2 → 1',NULL,NULL,NULL,NULL,NULL,NULL,NULL);
INSERT INTO "bom_changes" VALUES(4,2,3,'merge','2026-11-22T02:52:52.007398Z','admin','BOM updated: 0 added, 0 quantity changed, 1 unreferenced, 1 in conflict',NULL,NULL,NULL,NULL,'third',NULL,NULL);
INSERT INTO "bom_changes" VALUES(5,3,1,'merge','2026-11-22T02:52:52.014744Z','admin','BOM updated: 2 added, 0 quantity changed, 0 unreferenced',NULL,NULL,NULL,NULL,NULL,NULL,NULL);
INSERT INTO "bom_changes" VALUES(6,3,2,'edit','2026-11-22T02:52:52.022534Z','admin','PRT-400 added, quantity 0.5',NULL,NULL,NULL,NULL,NULL,NULL,NULL);
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
INSERT INTO "bom_conflicts" VALUES(2,4,2.0,'2026-11-22T02:52:52.007398Z',0);
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
INSERT INTO "bom_lines" VALUES('75181b77-7d7f-46da-acbe-a12775bd2473',2,4,1,'component',1.0,NULL,'[]',NULL,NULL,NULL,'manual',NULL,1,2.0,NULL,'{}');
INSERT INTO "bom_lines" VALUES('94d8e9b0-fe88-4358-b268-e667343ab4a4',2,5,2,'component',2.0,NULL,'[]',NULL,NULL,NULL,'assembly','2026-11-22T02:52:51.990012Z',0,NULL,NULL,'{}');
INSERT INTO "bom_lines" VALUES('b2647219-0b8b-4521-8f0e-6e2fd69bedf6',2,1,3,'component',12.0,NULL,'[]',NULL,NULL,NULL,'assembly',NULL,0,NULL,NULL,'{}');
INSERT INTO "bom_lines" VALUES('33e5390b-dd91-47f5-bc33-df93512f65f7',3,2,1,'component',3.0,NULL,'[]',NULL,NULL,NULL,'assembly',NULL,0,NULL,NULL,'{}');
INSERT INTO "bom_lines" VALUES('cb7caaf4-cbd2-4ea6-b881-c5e787fd2191',3,7,2,'component',1.0,NULL,'[]',NULL,NULL,NULL,'assembly',NULL,0,NULL,NULL,'{}');
INSERT INTO "bom_lines" VALUES('64d93936-f5d9-43e6-9c94-aa200a46bda7',3,5,3,'component',0.5,NULL,'[]',NULL,'glue',NULL,'manual',NULL,0,NULL,NULL,'{}');
CREATE TABLE bom_syncs (
	parent_id INTEGER NOT NULL, 
	sync_id VARCHAR(128) NOT NULL, 
	request_hash VARCHAR(64) NOT NULL, 
	answer TEXT NOT NULL, 
	version INTEGER NOT NULL, 
	at VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_bom_syncs PRIMARY KEY (parent_id, sync_id), 
	CONSTRAINT fk_bom_syncs_parent_id_items FOREIGN KEY(parent_id) REFERENCES items (id)
);
INSERT INTO "bom_syncs" VALUES(2,'first','d85e62493761392e879d128144fe5095f6944d6ceadf1e729eb8fa7df3d29577','{"status":"merged","diff":{"added":[{"part_number":"PRT-100","quantity":2},{"part_number":"PRT-400","quantity":2},{"part_number":"F01-0001","quantity":8}],"removed":[],"quantity_changed":[],"unchanged":[]},"warnings":[],"resolve_url":"/items/ASM-001/bom","sync_id":"first"}',1,'2026-11-22T02:52:51.975265Z');
INSERT INTO "bom_syncs" VALUES(2,'second','f6f75943662441d433c757c94063a40292b89f8d0a46825edabbc7ea1ec13c50','{"status":"merged","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[{"part_number":"F01-0001","old_quantity":8,"new_quantity":12}],"unchanged":[{"part_number":"PRT-100","quantity":2}]},"warnings":[{"type":"unreferenced","part_number":"PRT-400","message":"Present in server BOM but not in assembly"}],"resolve_url":"/items/ASM-001/bom","sync_id":"second"}',2,'2026-11-22T02:52:51.990012Z');
INSERT INTO "bom_syncs" VALUES(2,'third','f6f75943662441d433c757c94063a40292b89f8d0a46825edabbc7ea1ec13c50','{"status":"merged","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[],"unchanged":[{"part_number":"F01-0001","quantity":12}]},"warnings":[{"type":"unreferenced","part_number":"PRT-400","message":"Present in server BOM but not in assembly"},{"type":"conflict","part_number":"PRT-100","message":"The assembly has 2, Silo has 1 (set by a person); a person decides","assembly_quantity":2,"server_quantity":1}],"resolve_url":"/items/ASM-001/bom","sync_id":"third"}',3,'2026-11-22T02:52:52.007398Z');
CREATE TABLE events (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	name VARCHAR(64) NOT NULL, 
	item_uuid VARCHAR(36), 
	part_number_key VARCHAR(64), 
	data TEXT NOT NULL, 
	at VARCHAR(32) NOT NULL
);
INSERT INTO "events" VALUES(1,'server.state',NULL,NULL,'{"mode":"normal"}','2026-11-22T02:52:51.534568Z');
INSERT INTO "events" VALUES(2,'item.created','f4885c1f-0b88-47e4-b7ed-f1a5fd6492c4','f01-0001','{"part_number":"F01-0001","id":"f4885c1f-0b88-47e4-b7ed-f1a5fd6492c4","name":"Screw M4","description":"Screw M4","item_type":"part"}','2026-11-22T02:52:51.897168Z');
INSERT INTO "events" VALUES(3,'revision.created','c04dd842-f9f8-4741-9a62-d0560142d110','asm-001','{"part_number":"ASM-001","id":"c04dd842-f9f8-4741-9a62-d0560142d110","revision_number":1,"comment":"created","user":"admin"}','2026-11-22T02:52:51.909193Z');
INSERT INTO "events" VALUES(4,'item.created','c04dd842-f9f8-4741-9a62-d0560142d110','asm-001','{"part_number":"ASM-001","id":"c04dd842-f9f8-4741-9a62-d0560142d110","name":"ASM-001","description":"of ASM-001","item_type":"assembly"}','2026-11-22T02:52:51.909193Z');
INSERT INTO "events" VALUES(5,'revision.created','b3c4670e-c9a9-4e74-9ea0-e4531b5ef0b0','asm-top','{"part_number":"ASM-TOP","id":"b3c4670e-c9a9-4e74-9ea0-e4531b5ef0b0","revision_number":1,"comment":"created","user":"admin"}','2026-11-22T02:52:51.917111Z');
INSERT INTO "events" VALUES(6,'item.created','b3c4670e-c9a9-4e74-9ea0-e4531b5ef0b0','asm-top','{"part_number":"ASM-TOP","id":"b3c4670e-c9a9-4e74-9ea0-e4531b5ef0b0","name":"ASM-TOP","description":"of ASM-TOP","item_type":"assembly"}','2026-11-22T02:52:51.917111Z');
INSERT INTO "events" VALUES(7,'revision.created','71051cc3-8170-43ad-a0bf-ec0b0e017ed0','prt-100','{"part_number":"PRT-100","id":"71051cc3-8170-43ad-a0bf-ec0b0e017ed0","revision_number":1,"comment":"created","user":"admin"}','2026-11-22T02:52:51.923466Z');
INSERT INTO "events" VALUES(8,'item.created','71051cc3-8170-43ad-a0bf-ec0b0e017ed0','prt-100','{"part_number":"PRT-100","id":"71051cc3-8170-43ad-a0bf-ec0b0e017ed0","name":"PRT-100","description":"of PRT-100","item_type":"part"}','2026-11-22T02:52:51.923466Z');
INSERT INTO "events" VALUES(9,'revision.created','3fd2f2d4-cd51-44c9-a9a1-62f872d958aa','prt-400','{"part_number":"PRT-400","id":"3fd2f2d4-cd51-44c9-a9a1-62f872d958aa","revision_number":1,"comment":"created","user":"admin"}','2026-11-22T02:52:51.929129Z');
INSERT INTO "events" VALUES(10,'item.created','3fd2f2d4-cd51-44c9-a9a1-62f872d958aa','prt-400','{"part_number":"PRT-400","id":"3fd2f2d4-cd51-44c9-a9a1-62f872d958aa","name":"PRT-400","description":"of PRT-400","item_type":"part"}','2026-11-22T02:52:51.929129Z');
INSERT INTO "events" VALUES(11,'revision.created','f70ba1eb-e37d-4064-aa2b-45ea94638abf','prt-500','{"part_number":"PRT-500","id":"f70ba1eb-e37d-4064-aa2b-45ea94638abf","revision_number":1,"comment":"created","user":"admin"}','2026-11-22T02:52:51.935371Z');
INSERT INTO "events" VALUES(12,'item.created','f70ba1eb-e37d-4064-aa2b-45ea94638abf','prt-500','{"part_number":"PRT-500","id":"f70ba1eb-e37d-4064-aa2b-45ea94638abf","name":"PRT-500","description":"of PRT-500","item_type":"part"}','2026-11-22T02:52:51.935371Z');
INSERT INTO "events" VALUES(13,'revision.created','d5d49474-7210-4db6-8b3c-dea59daf7ac4','ünïcode-7','{"part_number":"Ünïcode-7","id":"d5d49474-7210-4db6-8b3c-dea59daf7ac4","revision_number":1,"comment":"created","user":"admin"}','2026-11-22T02:52:51.940532Z');
INSERT INTO "events" VALUES(14,'item.created','d5d49474-7210-4db6-8b3c-dea59daf7ac4','ünïcode-7','{"part_number":"Ünïcode-7","id":"d5d49474-7210-4db6-8b3c-dea59daf7ac4","name":"Ünïcode-7","description":"of Ünïcode-7","item_type":"part"}','2026-11-22T02:52:51.940532Z');
INSERT INTO "events" VALUES(15,'item.deleted','f70ba1eb-e37d-4064-aa2b-45ea94638abf','prt-500','{"part_number":"PRT-500","id":"f70ba1eb-e37d-4064-aa2b-45ea94638abf"}','2026-11-22T02:52:51.945395Z');
INSERT INTO "events" VALUES(16,'bom_merge','c04dd842-f9f8-4741-9a62-d0560142d110','asm-001','{"type":"bom_merge","item":"ASM-001","user":"admin","timestamp":"2026-11-22T02:52:51Z","summary":"BOM updated: 3 added, 0 quantity changed, 0 unreferenced","diff":{"added":[{"part_number":"PRT-100","quantity":2},{"part_number":"PRT-400","quantity":2},{"part_number":"F01-0001","quantity":8}],"removed":[],"quantity_changed":[],"unchanged":[]},"resolve_url":"/items/ASM-001/bom","sync_id":"first"}','2026-11-22T02:52:51.975265Z');
INSERT INTO "events" VALUES(17,'bom_merge','c04dd842-f9f8-4741-9a62-d0560142d110','asm-001','{"type":"bom_merge","item":"ASM-001","user":"admin","timestamp":"2026-11-22T02:52:51Z","summary":"BOM updated: 0 added, 1 quantity changed, 1 unreferenced","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[{"part_number":"F01-0001","old_quantity":8,"new_quantity":12}],"unchanged":[{"part_number":"PRT-100","quantity":2}]},"resolve_url":"/items/ASM-001/bom","sync_id":"second"}','2026-11-22T02:52:51.990012Z');
INSERT INTO "events" VALUES(18,'bom.updated','c04dd842-f9f8-4741-9a62-d0560142d110','asm-001','{"item":"ASM-001","kind":"edit","user":"admin","timestamp":"2026-11-22T02:52:51Z","summary":"PRT-100 changed: quantity 2 → 1"}','2026-11-22T02:52:51.998310Z');
INSERT INTO "events" VALUES(19,'bom_merge','c04dd842-f9f8-4741-9a62-d0560142d110','asm-001','{"type":"bom_merge","item":"ASM-001","user":"admin","timestamp":"2026-11-22T02:52:52Z","summary":"BOM updated: 0 added, 0 quantity changed, 1 unreferenced, 1 in conflict","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[],"unchanged":[{"part_number":"F01-0001","quantity":12}]},"resolve_url":"/items/ASM-001/bom","sync_id":"third","warnings":[{"type":"unreferenced","part_number":"PRT-400","message":"Present in server BOM but not in assembly"},{"type":"conflict","part_number":"PRT-100","message":"The assembly has 2, Silo has 1 (set by a person); a person decides","assembly_quantity":2,"server_quantity":1}]}','2026-11-22T02:52:52.007398Z');
INSERT INTO "events" VALUES(20,'bom_merge','b3c4670e-c9a9-4e74-9ea0-e4531b5ef0b0','asm-top','{"type":"bom_merge","item":"ASM-TOP","user":"admin","timestamp":"2026-11-22T02:52:52Z","summary":"BOM updated: 2 added, 0 quantity changed, 0 unreferenced","diff":{"added":[{"part_number":"ASM-001","quantity":3},{"part_number":"Ünïcode-7","quantity":1}],"removed":[],"quantity_changed":[],"unchanged":[]},"resolve_url":"/items/ASM-TOP/bom"}','2026-11-22T02:52:52.014744Z');
INSERT INTO "events" VALUES(21,'bom.updated','b3c4670e-c9a9-4e74-9ea0-e4531b5ef0b0','asm-top','{"item":"ASM-TOP","kind":"edit","user":"admin","timestamp":"2026-11-22T02:52:52Z","summary":"PRT-400 added, quantity 0.5"}','2026-11-22T02:52:52.022534Z');
INSERT INTO "events" VALUES(22,'revision.created','71051cc3-8170-43ad-a0bf-ec0b0e017ed0','prt-100','{"part_number":"PRT-100","id":"71051cc3-8170-43ad-a0bf-ec0b0e017ed0","revision_number":2,"comment":"as built","user":"admin"}','2026-11-22T02:52:52.034125Z');
INSERT INTO "events" VALUES(23,'revision.created','c04dd842-f9f8-4741-9a62-d0560142d110','asm-001','{"part_number":"ASM-001","id":"c04dd842-f9f8-4741-9a62-d0560142d110","revision_number":2,"comment":"as built","user":"admin"}','2026-11-22T02:52:52.043518Z');
CREATE TABLE items (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	uuid VARCHAR(36) NOT NULL, 
	part_number VARCHAR(64) NOT NULL, 
	part_number_key VARCHAR(64) NOT NULL, 
	schema_name VARCHAR(64), 
	category VARCHAR(32), 
	item_type VARCHAR(32) NOT NULL, 
	name TEXT NOT NULL, 
	description TEXT NOT NULL, 
	search_key TEXT NOT NULL, 
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
	archived_at VARCHAR(32), 
	CONSTRAINT uq_items_part_number_key UNIQUE (part_number_key), 
	CONSTRAINT uq_items_uuid UNIQUE (uuid)
);
INSERT INTO "items" VALUES(1,'f4885c1f-0b88-47e4-b7ed-f1a5fd6492c4','F01-0001','f01-0001','kindred-rd','F01','part','Screw M4','Screw M4','f01-0001
screw m4
screw m4',NULL,NULL,NULL,'{}',0,0,'2026-11-22T02:52:51.897168Z','admin','2026-11-22T02:52:51.897168Z','admin',NULL);
INSERT INTO "items" VALUES(2,'c04dd842-f9f8-4741-9a62-d0560142d110','ASM-001','asm-001','kindred-rd',NULL,'assembly','ASM-001','of ASM-001','asm-001
asm-001
of asm-001',NULL,NULL,'93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456','{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}',2,3,'2026-11-22T02:52:51.909193Z','admin','2026-11-22T02:52:52.043518Z','admin',NULL);
INSERT INTO "items" VALUES(3,'b3c4670e-c9a9-4e74-9ea0-e4531b5ef0b0','ASM-TOP','asm-top','kindred-rd',NULL,'assembly','ASM-TOP','of ASM-TOP','asm-top
asm-top
of asm-top',NULL,NULL,NULL,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}',1,2,'2026-11-22T02:52:51.917111Z','admin','2026-11-22T02:52:51.917111Z','admin',NULL);
INSERT INTO "items" VALUES(4,'71051cc3-8170-43ad-a0bf-ec0b0e017ed0','PRT-100','prt-100','kindred-rd',NULL,'part','PRT-100','of PRT-100','prt-100
prt-100
of prt-100',NULL,NULL,'93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456','{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}',2,0,'2026-11-22T02:52:51.923466Z','admin','2026-11-22T02:52:52.034125Z','admin',NULL);
INSERT INTO "items" VALUES(5,'3fd2f2d4-cd51-44c9-a9a1-62f872d958aa','PRT-400','prt-400','kindred-rd',NULL,'part','PRT-400','of PRT-400','prt-400
prt-400
of prt-400',NULL,NULL,NULL,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}',1,0,'2026-11-22T02:52:51.929129Z','admin','2026-11-22T02:52:51.929129Z','admin',NULL);
INSERT INTO "items" VALUES(6,'f70ba1eb-e37d-4064-aa2b-45ea94638abf','PRT-500','prt-500','kindred-rd',NULL,'part','PRT-500','of PRT-500','prt-500
prt-500
of prt-500',NULL,NULL,NULL,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}',1,0,'2026-11-22T02:52:51.935371Z','admin','2026-11-22T02:52:51.935371Z','admin','2026-11-22T02:52:51.945395Z');
INSERT INTO "items" VALUES(7,'d5d49474-7210-4db6-8b3c-dea59daf7ac4','Ünïcode-7','ünïcode-7','kindred-rd',NULL,'part','Ünïcode-7','of Ünïcode-7','ünïcode-7
ünïcode-7
of ünïcode-7',NULL,NULL,NULL,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}',1,0,'2026-11-22T02:52:51.940532Z','admin','2026-11-22T02:52:51.940532Z','admin',NULL);
CREATE TABLE login_failures (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	username_key VARCHAR(64) NOT NULL, 
	address VARCHAR(64) NOT NULL, 
	at VARCHAR(32) NOT NULL
);
INSERT INTO "login_failures" VALUES(1,'admin','127.0.0.1','2026-11-22T02:52:51.750631Z');
CREATE TABLE login_links (
	token_hash VARCHAR(64) NOT NULL, 
	user_id INTEGER NOT NULL, 
	expires_at VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_login_links PRIMARY KEY (token_hash), 
	CONSTRAINT fk_login_links_user_id_users FOREIGN KEY(user_id) REFERENCES users (id)
);
INSERT INTO "login_links" VALUES('274e7629139303467947f5bcae8396a21de3b3453a99ffbd80539bc8586850b2',1,'2026-11-22T03:52:51.330459Z');
INSERT INTO "login_links" VALUES('6f901270bbc111fa8b07025a4ac1475f490043c4e775c901684fd8e06160fff3',2,'2026-11-22T03:52:51.529582Z');
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
INSERT INTO "revisions" VALUES(1,2,1,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','created','draft',NULL,NULL,NULL,NULL,NULL,'2026-11-22T02:52:51.909193Z','admin');
INSERT INTO "revisions" VALUES(2,3,1,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','created','draft',NULL,NULL,NULL,NULL,NULL,'2026-11-22T02:52:51.917111Z','admin');
INSERT INTO "revisions" VALUES(3,4,1,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','created','draft',NULL,NULL,NULL,NULL,NULL,'2026-11-22T02:52:51.923466Z','admin');
INSERT INTO "revisions" VALUES(4,5,1,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','created','draft',NULL,NULL,NULL,NULL,NULL,'2026-11-22T02:52:51.929129Z','admin');
INSERT INTO "revisions" VALUES(5,6,1,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','created','draft',NULL,NULL,NULL,NULL,NULL,'2026-11-22T02:52:51.935371Z','admin');
INSERT INTO "revisions" VALUES(6,7,1,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','created','draft',NULL,NULL,NULL,NULL,NULL,'2026-11-22T02:52:51.940532Z','admin');
INSERT INTO "revisions" VALUES(7,4,2,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','as built','draft','gear.FCStd','3f0d2493fca8ed7ee07d300ed774fa029a82b82483e5568d79fc6cfeb7cde452',305,'93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456','k1','2026-11-22T02:52:52.034125Z','admin');
INSERT INTO "revisions" VALUES(8,2,2,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','as built','draft','gear.FCStd','3f0d2493fca8ed7ee07d300ed774fa029a82b82483e5568d79fc6cfeb7cde452',305,'93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456','k1','2026-11-22T02:52:52.043518Z','admin');
CREATE TABLE server_state (
	"key" VARCHAR(64) NOT NULL, 
	value TEXT NOT NULL, 
	CONSTRAINT pk_server_state PRIMARY KEY ("key")
);
INSERT INTO "server_state" VALUES('mode','normal');
CREATE TABLE sessions (
	id_hash VARCHAR(64) NOT NULL, 
	user_id INTEGER NOT NULL, 
	csrf_token VARCHAR(64) NOT NULL, 
	created_at VARCHAR(32) NOT NULL, 
	expires_at VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_sessions PRIMARY KEY (id_hash), 
	CONSTRAINT fk_sessions_user_id_users FOREIGN KEY(user_id) REFERENCES users (id)
);
INSERT INTO "sessions" VALUES('a266405f5acdac3ca685c72708f5cc8d3242aa4673818ffcd99fa5a009575d2c',2,'E_e0523QzmzpqcE6F16bOzdBuMHxBcl3yhrg36NhzA8','2026-11-22T02:52:51.862820Z','2026-11-23T02:52:51.862820Z');
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
INSERT INTO "users" VALUES(1,'admin','admin','admin','admin',NULL,1,'2026-11-22T02:52:51.330459Z');
INSERT INTO "users" VALUES(2,'zoe','zoe','zoe','editor','$argon2id$v=19$m=65536,t=3,p=4$g4McWjHqEyv7GIuUqmSTiQ$s6mAN2yp2jutND/btsuPhqga57v4w+2cSWuiHtn24eo',1,'2026-11-22T02:52:51.407999Z');
CREATE INDEX ix_login_failures_address_at ON login_failures (address, at);
CREATE INDEX ix_login_failures_username_key_at ON login_failures (username_key, at);
CREATE INDEX ix_api_tokens_user_id ON api_tokens (user_id);
CREATE INDEX ix_bom_changes_parent_id_id ON bom_changes (parent_id, id);
CREATE INDEX ix_bom_lines_child_id ON bom_lines (child_id);
CREATE INDEX ix_bom_syncs_at ON bom_syncs (at);
CREATE INDEX ix_revisions_file_checksum ON revisions (file_checksum);
CREATE INDEX ix_sessions_user_id ON sessions (user_id);
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('users',2);
INSERT INTO "sqlite_sequence" VALUES('audit',9);
INSERT INTO "sqlite_sequence" VALUES('api_tokens',2);
INSERT INTO "sqlite_sequence" VALUES('events',23);
INSERT INTO "sqlite_sequence" VALUES('login_failures',1);
INSERT INTO "sqlite_sequence" VALUES('items',7);
INSERT INTO "sqlite_sequence" VALUES('revisions',8);
INSERT INTO "sqlite_sequence" VALUES('bom_changes',6);
COMMIT;
