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
INSERT INTO "api_tokens" VALUES(1,1,'SILO_API_TOKEN','aa555d5e7fd295d76f5937b31863bd0d09e9afbbfbbb7013bfdc6775be7ae073','silo_rele','2026-11-21T10:19:21.921403Z',NULL,'2026-11-21T10:19:22.187443Z',NULL);
CREATE TABLE audit (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	at VARCHAR(32) NOT NULL, 
	username VARCHAR(64) NOT NULL, 
	action VARCHAR(64) NOT NULL, 
	target TEXT NOT NULL, 
	detail TEXT NOT NULL, 
	address VARCHAR(64) NOT NULL
);
INSERT INTO "audit" VALUES(1,'2026-11-21T10:19:21.921403Z','system','user.created','admin','role admin','');
INSERT INTO "audit" VALUES(2,'2026-11-21T10:19:21.921403Z','system','token.created','SILO_API_TOKEN','','');
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
INSERT INTO "bom_change_lines" VALUES(1,'47dca02e-2aed-4e53-bc1e-d745ec543d26',2,1,'added',NULL,'{"quantity":2.0,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(1,'f39c8024-d5fd-484f-81b2-03eac994172c',3,2,'added',NULL,'{"quantity":2.0,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(1,'94016ed0-946d-42e6-a38f-e80cedea5ea5',4,3,'added',NULL,'{"quantity":8.0,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(2,'f39c8024-d5fd-484f-81b2-03eac994172c',3,2,'changed','{"quantity":2.0,"source":"assembly","rel_type":"component"}','{"quantity":2.0,"source":"assembly","rel_type":"component","unreferenced_since":"2026-11-21T10:19:22.372715Z"}');
INSERT INTO "bom_change_lines" VALUES(2,'94016ed0-946d-42e6-a38f-e80cedea5ea5',4,3,'changed','{"quantity":8.0,"source":"assembly","rel_type":"component"}','{"quantity":12,"source":"assembly","rel_type":"component"}');
INSERT INTO "bom_change_lines" VALUES(3,'47dca02e-2aed-4e53-bc1e-d745ec543d26',2,1,'changed','{"quantity":2.0,"source":"assembly","rel_type":"component"}','{"quantity":1.0,"source":"manual","rel_type":"component","notes":"one is enough","override":true,"cad_quantity":2.0}');
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
INSERT INTO "bom_changes" VALUES(1,1,1,'merge','2026-11-21T10:19:22.340870Z','admin','BOM updated: 3 added, 0 quantity changed, 0 unreferenced',NULL,NULL,NULL,NULL,NULL,NULL,NULL);
INSERT INTO "bom_changes" VALUES(2,1,2,'merge','2026-11-21T10:19:22.372715Z','admin','BOM updated: 0 added, 1 quantity changed, 1 unreferenced',NULL,'Top.FCStd',NULL,1,'first',NULL,NULL);
INSERT INTO "bom_changes" VALUES(3,1,3,'edit','2026-11-21T10:19:22.381787Z','admin','PRT-100 changed: quantity 2 → 1',NULL,NULL,NULL,NULL,NULL,NULL,NULL);
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
INSERT INTO "bom_lines" VALUES('47dca02e-2aed-4e53-bc1e-d745ec543d26',1,2,1,'component',1.0,NULL,'[]',NULL,'one is enough',NULL,'manual',NULL,1,2.0,NULL,'{}');
INSERT INTO "bom_lines" VALUES('f39c8024-d5fd-484f-81b2-03eac994172c',1,3,2,'component',2.0,NULL,'[]',NULL,NULL,NULL,'assembly','2026-11-21T10:19:22.372715Z',0,NULL,NULL,'{}');
INSERT INTO "bom_lines" VALUES('94016ed0-946d-42e6-a38f-e80cedea5ea5',1,4,3,'component',12.0,NULL,'[]',NULL,NULL,NULL,'assembly',NULL,0,NULL,NULL,'{}');
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
INSERT INTO "bom_syncs" VALUES(1,'first','f6f75943662441d433c757c94063a40292b89f8d0a46825edabbc7ea1ec13c50','{"status":"merged","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[{"part_number":"F01-0001","old_quantity":8,"new_quantity":12}],"unchanged":[{"part_number":"PRT-100","quantity":2}]},"warnings":[{"type":"unreferenced","part_number":"PRT-400","message":"Present in server BOM but not in assembly"}],"resolve_url":"/items/ASM-001/bom","sync_id":"first"}',2,'2026-11-21T10:19:22.372715Z');
CREATE TABLE events (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	name VARCHAR(64) NOT NULL, 
	item_uuid VARCHAR(36), 
	part_number_key VARCHAR(64), 
	data TEXT NOT NULL, 
	at VARCHAR(32) NOT NULL
);
INSERT INTO "events" VALUES(1,'item.created','3924c833-8339-4394-9767-bf57accfd6d0','asm-001','{"part_number":"ASM-001","id":"3924c833-8339-4394-9767-bf57accfd6d0","name":"ASM-001","description":"ASM-001","item_type":"part"}','2026-11-21T10:19:22.211905Z');
INSERT INTO "events" VALUES(2,'item.created','676067b7-3d27-415e-a1e0-75c31c81a634','prt-100','{"part_number":"PRT-100","id":"676067b7-3d27-415e-a1e0-75c31c81a634","name":"PRT-100","description":"PRT-100","item_type":"part"}','2026-11-21T10:19:22.242162Z');
INSERT INTO "events" VALUES(3,'item.created','b3f575b7-45b6-4027-ba65-3ceef0e2e49b','prt-400','{"part_number":"PRT-400","id":"b3f575b7-45b6-4027-ba65-3ceef0e2e49b","name":"PRT-400","description":"PRT-400","item_type":"part"}','2026-11-21T10:19:22.256802Z');
INSERT INTO "events" VALUES(4,'revision.created','a2bd9ba4-3d6b-4585-816c-bae5179d2b60','f01-0001','{"part_number":"F01-0001","id":"a2bd9ba4-3d6b-4585-816c-bae5179d2b60","revision_number":1,"comment":"created","user":"admin"}','2026-11-21T10:19:22.261075Z');
INSERT INTO "events" VALUES(5,'item.created','a2bd9ba4-3d6b-4585-816c-bae5179d2b60','f01-0001','{"part_number":"F01-0001","id":"a2bd9ba4-3d6b-4585-816c-bae5179d2b60","name":"M8x20 Bolt","description":"M8x20 Bolt","item_type":"part"}','2026-11-21T10:19:22.261075Z');
INSERT INTO "events" VALUES(6,'bom_merge','3924c833-8339-4394-9767-bf57accfd6d0','asm-001','{"type":"bom_merge","item":"ASM-001","user":"admin","timestamp":"2026-11-21T10:19:22Z","summary":"BOM updated: 3 added, 0 quantity changed, 0 unreferenced","diff":{"added":[{"part_number":"PRT-100","quantity":2},{"part_number":"PRT-400","quantity":2},{"part_number":"F01-0001","quantity":8}],"removed":[],"quantity_changed":[],"unchanged":[]},"resolve_url":"/items/ASM-001/bom"}','2026-11-21T10:19:22.340870Z');
INSERT INTO "events" VALUES(7,'bom_merge','3924c833-8339-4394-9767-bf57accfd6d0','asm-001','{"type":"bom_merge","item":"ASM-001","user":"admin","timestamp":"2026-11-21T10:19:22Z","summary":"BOM updated: 0 added, 1 quantity changed, 1 unreferenced","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[{"part_number":"F01-0001","old_quantity":8,"new_quantity":12}],"unchanged":[{"part_number":"PRT-100","quantity":2}]},"resolve_url":"/items/ASM-001/bom","sync_id":"first"}','2026-11-21T10:19:22.372715Z');
INSERT INTO "events" VALUES(8,'bom.updated','3924c833-8339-4394-9767-bf57accfd6d0','asm-001','{"item":"ASM-001","kind":"edit","user":"admin","timestamp":"2026-11-21T10:19:22Z","summary":"PRT-100 changed: quantity 2 → 1"}','2026-11-21T10:19:22.381787Z');
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
INSERT INTO "items" VALUES(1,'3924c833-8339-4394-9767-bf57accfd6d0','ASM-001','asm-001','kindred-rd',NULL,'part','ASM-001','ASM-001','asm-001
asm-001
asm-001',NULL,NULL,NULL,'{}',0,3,'2026-11-21T10:19:22.211905Z','admin','2026-11-21T10:19:22.211905Z','admin',NULL);
INSERT INTO "items" VALUES(2,'676067b7-3d27-415e-a1e0-75c31c81a634','PRT-100','prt-100','kindred-rd',NULL,'part','PRT-100','PRT-100','prt-100
prt-100
prt-100',NULL,NULL,NULL,'{}',0,0,'2026-11-21T10:19:22.242162Z','admin','2026-11-21T10:19:22.242162Z','admin',NULL);
INSERT INTO "items" VALUES(3,'b3f575b7-45b6-4027-ba65-3ceef0e2e49b','PRT-400','prt-400','kindred-rd',NULL,'part','PRT-400','PRT-400','prt-400
prt-400
prt-400',NULL,NULL,NULL,'{}',0,0,'2026-11-21T10:19:22.256802Z','admin','2026-11-21T10:19:22.256802Z','admin',NULL);
INSERT INTO "items" VALUES(4,'a2bd9ba4-3d6b-4585-816c-bae5179d2b60','F01-0001','f01-0001','kindred-rd','F01','part','M8x20 Bolt','M8x20 Bolt','f01-0001
m8x20 bolt
m8x20 bolt',NULL,NULL,NULL,'{"mass_kg":0.012}',1,0,'2026-11-21T10:19:22.261075Z','admin','2026-11-21T10:19:22.261075Z','admin',NULL);
CREATE TABLE login_failures (
	id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	username_key VARCHAR(64) NOT NULL, 
	address VARCHAR(64) NOT NULL, 
	at VARCHAR(32) NOT NULL
);
CREATE TABLE login_links (
	token_hash VARCHAR(64) NOT NULL, 
	user_id INTEGER NOT NULL, 
	expires_at VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_login_links PRIMARY KEY (token_hash), 
	CONSTRAINT fk_login_links_user_id_users FOREIGN KEY(user_id) REFERENCES users (id)
);
INSERT INTO "login_links" VALUES('27dc97c1c9bf9f0359342f1ceedd34f5015c7d37818354b0df815aa0405f0aac',1,'2026-11-21T11:19:21.921403Z');
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
INSERT INTO "revisions" VALUES(1,4,1,'{"mass_kg":0.012}','created','draft',NULL,NULL,NULL,NULL,NULL,'2026-11-21T10:19:22.261075Z','admin');
CREATE TABLE server_state (
	"key" VARCHAR(64) NOT NULL, 
	value TEXT NOT NULL, 
	CONSTRAINT pk_server_state PRIMARY KEY ("key")
);
CREATE TABLE sessions (
	id_hash VARCHAR(64) NOT NULL, 
	user_id INTEGER NOT NULL, 
	csrf_token VARCHAR(64) NOT NULL, 
	created_at VARCHAR(32) NOT NULL, 
	expires_at VARCHAR(32) NOT NULL, 
	CONSTRAINT pk_sessions PRIMARY KEY (id_hash), 
	CONSTRAINT fk_sessions_user_id_users FOREIGN KEY(user_id) REFERENCES users (id)
);
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
INSERT INTO "users" VALUES(1,'admin','admin','admin','admin',NULL,1,'2026-11-21T10:19:21.921403Z');
CREATE INDEX ix_login_failures_address_at ON login_failures (address, at);
CREATE INDEX ix_login_failures_username_key_at ON login_failures (username_key, at);
CREATE INDEX ix_api_tokens_user_id ON api_tokens (user_id);
CREATE INDEX ix_bom_changes_parent_id_id ON bom_changes (parent_id, id);
CREATE INDEX ix_bom_lines_child_id ON bom_lines (child_id);
CREATE INDEX ix_bom_syncs_at ON bom_syncs (at);
CREATE INDEX ix_revisions_file_checksum ON revisions (file_checksum);
CREATE INDEX ix_sessions_user_id ON sessions (user_id);
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('users',1);
INSERT INTO "sqlite_sequence" VALUES('audit',2);
INSERT INTO "sqlite_sequence" VALUES('api_tokens',1);
INSERT INTO "sqlite_sequence" VALUES('items',4);
INSERT INTO "sqlite_sequence" VALUES('events',8);
INSERT INTO "sqlite_sequence" VALUES('revisions',1);
INSERT INTO "sqlite_sequence" VALUES('bom_changes',3);
COMMIT;
