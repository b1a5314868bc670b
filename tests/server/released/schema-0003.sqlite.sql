BEGIN TRANSACTION;
CREATE TABLE alembic_version (
	version_num VARCHAR(32) NOT NULL, 
	CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num)
);
INSERT INTO "alembic_version" VALUES('0003');
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
INSERT INTO "api_tokens" VALUES(1,1,'SILO_API_TOKEN','aa555d5e7fd295d76f5937b31863bd0d09e9afbbfbbb7013bfdc6775be7ae073','silo_rele','2026-11-22T06:24:15.444095Z',NULL,'2026-11-22T06:24:16.614890Z',NULL);
INSERT INTO "api_tokens" VALUES(2,1,'revoked','93e9673956f451f748a13f58e95908e69b0de60a9e0a4be1cb62b24f3320f549','silo_b959','2026-11-22T06:24:19.193364Z',NULL,NULL,'2026-11-22T06:24:19.203549Z');
CREATE TABLE audit (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	at VARCHAR(32) NOT NULL, 
	username VARCHAR(64) NOT NULL, 
	action VARCHAR(64) NOT NULL, 
	target TEXT NOT NULL, 
	detail TEXT NOT NULL, 
	address VARCHAR(64) NOT NULL
);
INSERT INTO "audit" VALUES(1,'2026-11-22T06:24:15.444095Z','system','user.created','admin','role admin','');
INSERT INTO "audit" VALUES(2,'2026-11-22T06:24:15.444095Z','system','token.created','SILO_API_TOKEN','','');
INSERT INTO "audit" VALUES(3,'2026-11-22T06:24:16.092251Z','admin','user.created','zoe','role editor','127.0.0.1');
INSERT INTO "audit" VALUES(4,'2026-11-22T06:24:16.582761Z','admin','login_link.created','zoe','','127.0.0.1');
INSERT INTO "audit" VALUES(5,'2026-11-22T06:24:16.615300Z','admin','mode.set','normal','','127.0.0.1');
INSERT INTO "audit" VALUES(6,'2026-11-22T06:24:18.221289Z','admin','login.failed','admin','','127.0.0.1');
INSERT INTO "audit" VALUES(7,'2026-11-22T06:24:19.168175Z','zoe','login','','','127.0.0.1');
INSERT INTO "audit" VALUES(8,'2026-11-22T06:24:19.193364Z','admin','token.created','revoked','','127.0.0.1');
INSERT INTO "audit" VALUES(9,'2026-11-22T06:24:19.203549Z','admin','token.revoked','revoked','','127.0.0.1');
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
INSERT INTO "bom_change_lines" VALUES(1,'d2a054fc-2b2c-4938-a146-5f8a895a627e',4,1,'added',NULL,'{"quantity":2.0,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(1,'e8d1d3aa-716b-49e3-84d6-53dcfe7770a8',5,2,'added',NULL,'{"quantity":2.0,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(1,'775171bd-cb5f-4a21-976a-d370992bd0c1',1,3,'added',NULL,'{"quantity":8.0,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(2,'e8d1d3aa-716b-49e3-84d6-53dcfe7770a8',5,2,'changed','{"quantity":2.0,"source":"assembly","rel_type":"component"}','{"quantity":2.0,"source":"assembly","rel_type":"component","unreferenced_since":"2026-11-22T06:24:19.463150Z"}');
INSERT INTO "bom_change_lines" VALUES(2,'775171bd-cb5f-4a21-976a-d370992bd0c1',1,3,'changed','{"quantity":8.0,"source":"assembly","rel_type":"component"}','{"quantity":12,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(3,'d2a054fc-2b2c-4938-a146-5f8a895a627e',4,1,'changed','{"quantity":2.0,"source":"assembly","rel_type":"component"}','{"quantity":1.0,"source":"manual","rel_type":"component","override":true,"cad_quantity":2.0}');
INSERT INTO "bom_change_lines" VALUES(5,'954cd178-7314-47bd-bf43-88604aa2e881',2,1,'added',NULL,'{"quantity":3.0,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(5,'b1bc2d03-e808-4020-87f6-b4264498ebf4',7,2,'added',NULL,'{"quantity":1.0,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(6,'541c6229-f577-41c1-8ee1-fc9b3ec1a5d5',5,3,'added',NULL,'{"quantity":0.5,"source":"manual","rel_type":"component","notes":"glue"}');
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
INSERT INTO "bom_changes" VALUES(1,2,1,'merge','2026-11-22T06:24:19.449148Z','admin','BOM updated: 3 added, 0 quantity changed, 0 unreferenced',NULL,NULL,NULL,NULL,'first',NULL,NULL);
INSERT INTO "bom_changes" VALUES(2,2,2,'merge','2026-11-22T06:24:19.463150Z','admin','BOM updated: 0 added, 1 quantity changed, 1 unreferenced',NULL,NULL,NULL,NULL,'second',NULL,NULL);
INSERT INTO "bom_changes" VALUES(3,2,3,'edit','2026-11-22T06:24:19.471959Z','admin','PRT-100 changed: quantity 2 → 1',NULL,NULL,NULL,NULL,NULL,NULL,NULL);
INSERT INTO "bom_changes" VALUES(4,2,3,'merge','2026-11-22T06:24:19.480017Z','admin','BOM updated: 0 added, 0 quantity changed, 1 unreferenced, 1 in conflict',NULL,NULL,NULL,NULL,'third',NULL,NULL);
INSERT INTO "bom_changes" VALUES(5,3,1,'merge','2026-11-22T06:24:19.487189Z','admin','BOM updated: 2 added, 0 quantity changed, 0 unreferenced',NULL,NULL,NULL,NULL,NULL,NULL,NULL);
INSERT INTO "bom_changes" VALUES(6,3,2,'edit','2026-11-22T06:24:19.496376Z','admin','PRT-400 added, quantity 0.5',NULL,NULL,NULL,NULL,NULL,NULL,NULL);
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
INSERT INTO "bom_conflicts" VALUES(2,4,2.0,'2026-11-22T06:24:19.480017Z',0);
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
INSERT INTO "bom_last_syncs" VALUES(2,'2026-11-22T06:24:19.480017Z','admin',NULL,'[]','{}',NULL,NULL);
INSERT INTO "bom_last_syncs" VALUES(3,'2026-11-22T06:24:19.487189Z','admin',NULL,'[{"reason":"missing","name":"Lid","file":"parts/Lid.FCStd","quantity":2}]','{}',NULL,NULL);
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
INSERT INTO "bom_lines" VALUES('d2a054fc-2b2c-4938-a146-5f8a895a627e',2,4,1,'component',1.0,NULL,'[]',NULL,NULL,NULL,'manual',NULL,1,2.0,NULL,'{}');
INSERT INTO "bom_lines" VALUES('e8d1d3aa-716b-49e3-84d6-53dcfe7770a8',2,5,2,'component',2.0,NULL,'[]',NULL,NULL,NULL,'assembly','2026-11-22T06:24:19.463150Z',0,NULL,NULL,'{}');
INSERT INTO "bom_lines" VALUES('775171bd-cb5f-4a21-976a-d370992bd0c1',2,1,3,'component',12.0,NULL,'[]',NULL,NULL,NULL,'assembly',NULL,0,NULL,NULL,'{}');
INSERT INTO "bom_lines" VALUES('954cd178-7314-47bd-bf43-88604aa2e881',3,2,1,'component',3.0,NULL,'[]',NULL,NULL,NULL,'assembly',NULL,0,NULL,NULL,'{}');
INSERT INTO "bom_lines" VALUES('b1bc2d03-e808-4020-87f6-b4264498ebf4',3,7,2,'component',1.0,NULL,'[]',NULL,NULL,NULL,'assembly',NULL,0,NULL,NULL,'{}');
INSERT INTO "bom_lines" VALUES('541c6229-f577-41c1-8ee1-fc9b3ec1a5d5',3,5,3,'component',0.5,NULL,'[]',NULL,'glue',NULL,'manual',NULL,0,NULL,NULL,'{}');
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
INSERT INTO "bom_syncs" VALUES(2,'first','d85e62493761392e879d128144fe5095f6944d6ceadf1e729eb8fa7df3d29577','{"status":"merged","diff":{"added":[{"part_number":"PRT-100","quantity":2},{"part_number":"PRT-400","quantity":2},{"part_number":"F01-0001","quantity":8}],"removed":[],"quantity_changed":[],"unchanged":[]},"warnings":[],"resolve_url":"/items/ASM-001/bom","sync_id":"first"}',1,'2026-11-22T06:24:19.449148Z',NULL);
INSERT INTO "bom_syncs" VALUES(2,'second','f6f75943662441d433c757c94063a40292b89f8d0a46825edabbc7ea1ec13c50','{"status":"merged","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[{"part_number":"F01-0001","old_quantity":8,"new_quantity":12}],"unchanged":[{"part_number":"PRT-100","quantity":2}]},"warnings":[{"type":"unreferenced","part_number":"PRT-400","message":"Present in server BOM but not in assembly"}],"resolve_url":"/items/ASM-001/bom","sync_id":"second"}',2,'2026-11-22T06:24:19.463150Z',NULL);
INSERT INTO "bom_syncs" VALUES(2,'third','f6f75943662441d433c757c94063a40292b89f8d0a46825edabbc7ea1ec13c50','{"status":"merged","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[],"unchanged":[{"part_number":"F01-0001","quantity":12}]},"warnings":[{"type":"unreferenced","part_number":"PRT-400","message":"Present in server BOM but not in assembly"},{"type":"conflict","part_number":"PRT-100","message":"The assembly has 2, Silo has 1 (set by a person); a person decides","assembly_quantity":2,"server_quantity":1}],"resolve_url":"/items/ASM-001/bom","sync_id":"third"}',3,'2026-11-22T06:24:19.480017Z',NULL);
CREATE TABLE events (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	name VARCHAR(64) NOT NULL, 
	item_uuid VARCHAR(36), 
	part_number_key VARCHAR(64), 
	data TEXT NOT NULL, 
	at VARCHAR(32) NOT NULL
);
INSERT INTO "events" VALUES(1,'server.state',NULL,NULL,'{"mode":"normal"}','2026-11-22T06:24:16.615300Z');
INSERT INTO "events" VALUES(2,'item.created','07d6e689-d1f6-4e99-968c-2b5fcfabce78','f01-0001','{"part_number":"F01-0001","id":"07d6e689-d1f6-4e99-968c-2b5fcfabce78","name":"Screw M4","description":"Screw M4","item_type":"part"}','2026-11-22T06:24:19.280015Z');
INSERT INTO "events" VALUES(3,'revision.created','b56e3eb4-ef71-4dd9-a525-115da427ae6a','asm-001','{"part_number":"ASM-001","id":"b56e3eb4-ef71-4dd9-a525-115da427ae6a","revision_number":1,"comment":"created","user":"admin"}','2026-11-22T06:24:19.339724Z');
INSERT INTO "events" VALUES(4,'item.created','b56e3eb4-ef71-4dd9-a525-115da427ae6a','asm-001','{"part_number":"ASM-001","id":"b56e3eb4-ef71-4dd9-a525-115da427ae6a","name":"ASM-001","description":"of ASM-001","item_type":"assembly"}','2026-11-22T06:24:19.339724Z');
INSERT INTO "events" VALUES(5,'revision.created','85e57db5-3d9d-4084-99a3-2866503c1229','asm-top','{"part_number":"ASM-TOP","id":"85e57db5-3d9d-4084-99a3-2866503c1229","revision_number":1,"comment":"created","user":"admin"}','2026-11-22T06:24:19.385063Z');
INSERT INTO "events" VALUES(6,'item.created','85e57db5-3d9d-4084-99a3-2866503c1229','asm-top','{"part_number":"ASM-TOP","id":"85e57db5-3d9d-4084-99a3-2866503c1229","name":"ASM-TOP","description":"of ASM-TOP","item_type":"assembly"}','2026-11-22T06:24:19.385063Z');
INSERT INTO "events" VALUES(7,'revision.created','5f6ecfaa-0413-430b-a630-bcf594f6d6fa','prt-100','{"part_number":"PRT-100","id":"5f6ecfaa-0413-430b-a630-bcf594f6d6fa","revision_number":1,"comment":"created","user":"admin"}','2026-11-22T06:24:19.393430Z');
INSERT INTO "events" VALUES(8,'item.created','5f6ecfaa-0413-430b-a630-bcf594f6d6fa','prt-100','{"part_number":"PRT-100","id":"5f6ecfaa-0413-430b-a630-bcf594f6d6fa","name":"PRT-100","description":"of PRT-100","item_type":"part"}','2026-11-22T06:24:19.393430Z');
INSERT INTO "events" VALUES(9,'revision.created','ede586ef-c761-4869-83a1-47e9614894b2','prt-400','{"part_number":"PRT-400","id":"ede586ef-c761-4869-83a1-47e9614894b2","revision_number":1,"comment":"created","user":"admin"}','2026-11-22T06:24:19.403303Z');
INSERT INTO "events" VALUES(10,'item.created','ede586ef-c761-4869-83a1-47e9614894b2','prt-400','{"part_number":"PRT-400","id":"ede586ef-c761-4869-83a1-47e9614894b2","name":"PRT-400","description":"of PRT-400","item_type":"part"}','2026-11-22T06:24:19.403303Z');
INSERT INTO "events" VALUES(11,'revision.created','09abfb2f-19a8-4c6a-9eea-74da19885eb2','prt-500','{"part_number":"PRT-500","id":"09abfb2f-19a8-4c6a-9eea-74da19885eb2","revision_number":1,"comment":"created","user":"admin"}','2026-11-22T06:24:19.409658Z');
INSERT INTO "events" VALUES(12,'item.created','09abfb2f-19a8-4c6a-9eea-74da19885eb2','prt-500','{"part_number":"PRT-500","id":"09abfb2f-19a8-4c6a-9eea-74da19885eb2","name":"PRT-500","description":"of PRT-500","item_type":"part"}','2026-11-22T06:24:19.409658Z');
INSERT INTO "events" VALUES(13,'revision.created','63a7eec9-fe53-463e-bce9-b9052af4c291','ünïcode-7','{"part_number":"Ünïcode-7","id":"63a7eec9-fe53-463e-bce9-b9052af4c291","revision_number":1,"comment":"created","user":"admin"}','2026-11-22T06:24:19.415054Z');
INSERT INTO "events" VALUES(14,'item.created','63a7eec9-fe53-463e-bce9-b9052af4c291','ünïcode-7','{"part_number":"Ünïcode-7","id":"63a7eec9-fe53-463e-bce9-b9052af4c291","name":"Ünïcode-7","description":"of Ünïcode-7","item_type":"part"}','2026-11-22T06:24:19.415054Z');
INSERT INTO "events" VALUES(15,'item.deleted','09abfb2f-19a8-4c6a-9eea-74da19885eb2','prt-500','{"part_number":"PRT-500","id":"09abfb2f-19a8-4c6a-9eea-74da19885eb2"}','2026-11-22T06:24:19.422657Z');
INSERT INTO "events" VALUES(16,'bom_merge','b56e3eb4-ef71-4dd9-a525-115da427ae6a','asm-001','{"type":"bom_merge","item":"ASM-001","user":"admin","timestamp":"2026-11-22T06:24:19Z","summary":"BOM updated: 3 added, 0 quantity changed, 0 unreferenced","diff":{"added":[{"part_number":"PRT-100","quantity":2},{"part_number":"PRT-400","quantity":2},{"part_number":"F01-0001","quantity":8}],"removed":[],"quantity_changed":[],"unchanged":[]},"resolve_url":"/items/ASM-001/bom","sync_id":"first"}','2026-11-22T06:24:19.449148Z');
INSERT INTO "events" VALUES(17,'bom_merge','b56e3eb4-ef71-4dd9-a525-115da427ae6a','asm-001','{"type":"bom_merge","item":"ASM-001","user":"admin","timestamp":"2026-11-22T06:24:19Z","summary":"BOM updated: 0 added, 1 quantity changed, 1 unreferenced","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[{"part_number":"F01-0001","old_quantity":8,"new_quantity":12}],"unchanged":[{"part_number":"PRT-100","quantity":2}]},"resolve_url":"/items/ASM-001/bom","sync_id":"second"}','2026-11-22T06:24:19.463150Z');
INSERT INTO "events" VALUES(18,'bom.updated','b56e3eb4-ef71-4dd9-a525-115da427ae6a','asm-001','{"item":"ASM-001","kind":"edit","user":"admin","timestamp":"2026-11-22T06:24:19Z","summary":"PRT-100 changed: quantity 2 → 1"}','2026-11-22T06:24:19.471959Z');
INSERT INTO "events" VALUES(19,'bom_merge','b56e3eb4-ef71-4dd9-a525-115da427ae6a','asm-001','{"type":"bom_merge","item":"ASM-001","user":"admin","timestamp":"2026-11-22T06:24:19Z","summary":"BOM updated: 0 added, 0 quantity changed, 1 unreferenced, 1 in conflict","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[],"unchanged":[{"part_number":"F01-0001","quantity":12}]},"resolve_url":"/items/ASM-001/bom","sync_id":"third","warnings":[{"type":"unreferenced","part_number":"PRT-400","message":"Present in server BOM but not in assembly"},{"type":"conflict","part_number":"PRT-100","message":"The assembly has 2, Silo has 1 (set by a person); a person decides","assembly_quantity":2,"server_quantity":1}]}','2026-11-22T06:24:19.480017Z');
INSERT INTO "events" VALUES(20,'bom_merge','85e57db5-3d9d-4084-99a3-2866503c1229','asm-top','{"type":"bom_merge","item":"ASM-TOP","user":"admin","timestamp":"2026-11-22T06:24:19Z","summary":"BOM updated: 2 added, 0 quantity changed, 0 unreferenced","diff":{"added":[{"part_number":"ASM-001","quantity":3},{"part_number":"Ünïcode-7","quantity":1}],"removed":[],"quantity_changed":[],"unchanged":[]},"resolve_url":"/items/ASM-TOP/bom","left_out":[{"reason":"missing","name":"Lid","file":"parts/Lid.FCStd","quantity":2}]}','2026-11-22T06:24:19.487189Z');
INSERT INTO "events" VALUES(21,'bom.updated','85e57db5-3d9d-4084-99a3-2866503c1229','asm-top','{"item":"ASM-TOP","kind":"edit","user":"admin","timestamp":"2026-11-22T06:24:19Z","summary":"PRT-400 added, quantity 0.5"}','2026-11-22T06:24:19.496376Z');
INSERT INTO "events" VALUES(22,'revision.created','5f6ecfaa-0413-430b-a630-bcf594f6d6fa','prt-100','{"part_number":"PRT-100","id":"5f6ecfaa-0413-430b-a630-bcf594f6d6fa","revision_number":2,"comment":"as built","user":"admin"}','2026-11-22T06:24:19.511922Z');
INSERT INTO "events" VALUES(23,'revision.created','b56e3eb4-ef71-4dd9-a525-115da427ae6a','asm-001','{"part_number":"ASM-001","id":"b56e3eb4-ef71-4dd9-a525-115da427ae6a","revision_number":2,"comment":"as built","user":"admin"}','2026-11-22T06:24:19.527008Z');
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
	archived_at VARCHAR(32), 
	CONSTRAINT uq_items_part_number_key UNIQUE (part_number_key), 
	CONSTRAINT uq_items_uuid UNIQUE (uuid)
);
INSERT INTO "items" VALUES(1,'07d6e689-d1f6-4e99-968c-2b5fcfabce78','F01-0001','f01-0001','kindred-rd','F01','part','Screw M4','Screw M4',NULL,NULL,NULL,'{}',0,0,'2026-11-22T06:24:19.280015Z','admin','2026-11-22T06:24:19.280015Z','admin',NULL);
INSERT INTO "items" VALUES(2,'b56e3eb4-ef71-4dd9-a525-115da427ae6a','ASM-001','asm-001','kindred-rd',NULL,'assembly','ASM-001','of ASM-001',NULL,NULL,'93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456','{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}',2,3,'2026-11-22T06:24:19.339724Z','admin','2026-11-22T06:24:19.527008Z','admin',NULL);
INSERT INTO "items" VALUES(3,'85e57db5-3d9d-4084-99a3-2866503c1229','ASM-TOP','asm-top','kindred-rd',NULL,'assembly','ASM-TOP','of ASM-TOP',NULL,NULL,NULL,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}',1,2,'2026-11-22T06:24:19.385063Z','admin','2026-11-22T06:24:19.385063Z','admin',NULL);
INSERT INTO "items" VALUES(4,'5f6ecfaa-0413-430b-a630-bcf594f6d6fa','PRT-100','prt-100','kindred-rd',NULL,'part','PRT-100','of PRT-100',NULL,NULL,'93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456','{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}',2,0,'2026-11-22T06:24:19.393430Z','admin','2026-11-22T06:24:19.511922Z','admin',NULL);
INSERT INTO "items" VALUES(5,'ede586ef-c761-4869-83a1-47e9614894b2','PRT-400','prt-400','kindred-rd',NULL,'part','PRT-400','of PRT-400',NULL,NULL,NULL,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}',1,0,'2026-11-22T06:24:19.403303Z','admin','2026-11-22T06:24:19.403303Z','admin',NULL);
INSERT INTO "items" VALUES(6,'09abfb2f-19a8-4c6a-9eea-74da19885eb2','PRT-500','prt-500','kindred-rd',NULL,'part','PRT-500','of PRT-500',NULL,NULL,NULL,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}',1,0,'2026-11-22T06:24:19.409658Z','admin','2026-11-22T06:24:19.409658Z','admin','2026-11-22T06:24:19.422657Z');
INSERT INTO "items" VALUES(7,'63a7eec9-fe53-463e-bce9-b9052af4c291','Ünïcode-7','ünïcode-7','kindred-rd',NULL,'part','Ünïcode-7','of Ünïcode-7',NULL,NULL,NULL,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}',1,0,'2026-11-22T06:24:19.415054Z','admin','2026-11-22T06:24:19.415054Z','admin',NULL);
CREATE TABLE login_failures (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	username_key VARCHAR(64) NOT NULL, 
	address VARCHAR(64) NOT NULL, 
	at VARCHAR(32) NOT NULL
);
INSERT INTO "login_failures" VALUES(1,'admin','127.0.0.1','2026-11-22T06:24:16.627494Z');
CREATE TABLE login_links (
	token_hash VARCHAR(64) NOT NULL, 
	user_id INTEGER NOT NULL, 
	expires_at VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_login_links PRIMARY KEY (token_hash), 
	CONSTRAINT fk_login_links_user_id_users FOREIGN KEY(user_id) REFERENCES users (id)
);
INSERT INTO "login_links" VALUES('738cbb87ebb875662545252ca3d025a1b335b8b3709161557168b6f4d0bb46aa',1,'2026-11-22T07:24:15.444095Z');
INSERT INTO "login_links" VALUES('27900d03f17be28837e6b6a395605b2377e4934b213ac89582605a433eb08a1c',2,'2026-11-22T07:24:16.582761Z');
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
INSERT INTO "revisions" VALUES(1,2,1,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','created','draft',NULL,NULL,NULL,NULL,NULL,'2026-11-22T06:24:19.339724Z','admin');
INSERT INTO "revisions" VALUES(2,3,1,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','created','draft',NULL,NULL,NULL,NULL,NULL,'2026-11-22T06:24:19.385063Z','admin');
INSERT INTO "revisions" VALUES(3,4,1,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','created','draft',NULL,NULL,NULL,NULL,NULL,'2026-11-22T06:24:19.393430Z','admin');
INSERT INTO "revisions" VALUES(4,5,1,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','created','draft',NULL,NULL,NULL,NULL,NULL,'2026-11-22T06:24:19.403303Z','admin');
INSERT INTO "revisions" VALUES(5,6,1,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','created','draft',NULL,NULL,NULL,NULL,NULL,'2026-11-22T06:24:19.409658Z','admin');
INSERT INTO "revisions" VALUES(6,7,1,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','created','draft',NULL,NULL,NULL,NULL,NULL,'2026-11-22T06:24:19.415054Z','admin');
INSERT INTO "revisions" VALUES(7,4,2,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','as built','draft','gear.FCStd','67d4552b016aa4ed45c066b2ccd49b13a6fd002ec081acb91e53bc292b35b8d4',305,'93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456','k1','2026-11-22T06:24:19.511922Z','admin');
INSERT INTO "revisions" VALUES(8,2,2,'{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}','as built','draft','gear.FCStd','67d4552b016aa4ed45c066b2ccd49b13a6fd002ec081acb91e53bc292b35b8d4',305,'93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456','k1','2026-11-22T06:24:19.527008Z','admin');
CREATE TABLE server_state (
	"key" VARCHAR(64) NOT NULL, 
	value TEXT NOT NULL, 
	CONSTRAINT pk_server_state PRIMARY KEY ("key")
);
INSERT INTO "server_state" VALUES('search_index','1');
INSERT INTO "server_state" VALUES('housekeeping_of_files','1795328655.482518');
INSERT INTO "server_state" VALUES('housekeeping','{"at":"2026-11-22T06:24:15.467693Z","seconds":0.024,"removed":{},"problem":null}');
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
INSERT INTO "sessions" VALUES('7c63f96874eef865db80d302e7e376f3306e3b858b8b21d276dbba4625f15c45',2,'YPe0tPy_3sIkOwQ2KN0Y7DZg4DeodQaaG_wVFFq0W4Q','2026-11-22T06:24:19.168175Z','2026-11-23T06:24:19.168175Z');
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
INSERT INTO "users" VALUES(1,'admin','admin','admin','admin',NULL,1,'2026-11-22T06:24:15.444095Z');
INSERT INTO "users" VALUES(2,'zoe','zoe','zoe','editor','$argon2id$v=19$m=65536,t=3,p=4$RGDTDOEoNtEvJz7GEt8tDQ$nyXKfwhxSFLtc7f1YxXMBzYIpuUyq0fwQOfMdiaGvfs',1,'2026-11-22T06:24:16.092251Z');
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
