SELECT pg_catalog.set_config('search_path', '', false);
CREATE TABLE public.alembic_version (
    version_num character varying(32) NOT NULL
);
CREATE TABLE public.api_tokens (
    id bigint NOT NULL,
    user_id bigint NOT NULL,
    name text NOT NULL,
    token_hash character varying(64) NOT NULL,
    prefix character varying(16) NOT NULL,
    created_at character varying(32) NOT NULL,
    expires_at character varying(32),
    last_used_at character varying(32),
    revoked_at character varying(32)
);
CREATE SEQUENCE public.api_tokens_id_seq
    START WITH 1
    INCREMENT BY 1
    NO MINVALUE
    NO MAXVALUE
    CACHE 1;
ALTER SEQUENCE public.api_tokens_id_seq OWNED BY public.api_tokens.id;
CREATE TABLE public.audit (
    id bigint NOT NULL,
    at character varying(32) NOT NULL,
    username character varying(64) NOT NULL,
    action character varying(64) NOT NULL,
    target text NOT NULL,
    detail text NOT NULL,
    address character varying(64) NOT NULL
);
CREATE SEQUENCE public.audit_id_seq
    START WITH 1
    INCREMENT BY 1
    NO MINVALUE
    NO MAXVALUE
    CACHE 1;
ALTER SEQUENCE public.audit_id_seq OWNED BY public.audit.id;
CREATE TABLE public.bom_change_lines (
    change_id bigint NOT NULL,
    line_id character varying(36) NOT NULL,
    child_id bigint NOT NULL,
    "position" integer NOT NULL,
    action character varying(16) NOT NULL,
    before text,
    after text
);
CREATE TABLE public.bom_changes (
    id bigint NOT NULL,
    parent_id bigint NOT NULL,
    version integer NOT NULL,
    kind character varying(16) NOT NULL,
    at character varying(32) NOT NULL,
    username character varying(64) NOT NULL,
    summary text NOT NULL,
    reason text,
    document_file text,
    document_sha256 character varying(64),
    document_revision integer,
    sync_id character varying(128),
    refers_to bigint,
    decisions text
);
CREATE SEQUENCE public.bom_changes_id_seq
    START WITH 1
    INCREMENT BY 1
    NO MINVALUE
    NO MAXVALUE
    CACHE 1;
ALTER SEQUENCE public.bom_changes_id_seq OWNED BY public.bom_changes.id;
CREATE TABLE public.bom_conflicts (
    parent_id bigint NOT NULL,
    child_id bigint NOT NULL,
    cad_quantity double precision NOT NULL,
    since character varying(32) NOT NULL,
    accepted boolean NOT NULL
);
CREATE TABLE public.bom_lines (
    id character varying(36) NOT NULL,
    parent_id bigint NOT NULL,
    child_id bigint NOT NULL,
    "position" integer NOT NULL,
    rel_type character varying(16) NOT NULL,
    quantity double precision NOT NULL,
    unit character varying(32),
    reference_designators text NOT NULL,
    find_number character varying(32),
    notes text,
    child_revision integer,
    source character varying(16) NOT NULL,
    unreferenced_since character varying(32),
    override boolean NOT NULL,
    cad_quantity double precision,
    reason text,
    metadata text NOT NULL
);
CREATE TABLE public.bom_syncs (
    parent_id bigint NOT NULL,
    sync_id character varying(128) NOT NULL,
    request_hash character varying(64) NOT NULL,
    answer text NOT NULL,
    version integer NOT NULL,
    at character varying(32) NOT NULL
);
CREATE TABLE public.events (
    id bigint NOT NULL,
    name character varying(64) NOT NULL,
    item_uuid character varying(36),
    part_number_key character varying(64),
    data text NOT NULL,
    at character varying(32) NOT NULL
);
CREATE SEQUENCE public.events_id_seq
    START WITH 1
    INCREMENT BY 1
    NO MINVALUE
    NO MAXVALUE
    CACHE 1;
ALTER SEQUENCE public.events_id_seq OWNED BY public.events.id;
CREATE TABLE public.items (
    id bigint NOT NULL,
    uuid character varying(36) NOT NULL,
    part_number character varying(64) NOT NULL,
    part_number_key character varying(64) NOT NULL,
    schema_name character varying(64),
    category character varying(32),
    item_type character varying(32) NOT NULL,
    name text NOT NULL,
    description text NOT NULL,
    search_key text NOT NULL,
    sourcing_type character varying(64),
    long_description text,
    thumbnail_key character varying(64),
    properties text NOT NULL,
    current_revision integer NOT NULL,
    bom_version integer NOT NULL,
    created_at character varying(32) NOT NULL,
    created_by character varying(64) NOT NULL,
    updated_at character varying(32) NOT NULL,
    updated_by character varying(64) NOT NULL,
    archived_at character varying(32)
);
CREATE SEQUENCE public.items_id_seq
    START WITH 1
    INCREMENT BY 1
    NO MINVALUE
    NO MAXVALUE
    CACHE 1;
ALTER SEQUENCE public.items_id_seq OWNED BY public.items.id;
CREATE TABLE public.login_failures (
    id bigint NOT NULL,
    username_key character varying(64) NOT NULL,
    address character varying(64) NOT NULL,
    at character varying(32) NOT NULL
);
CREATE SEQUENCE public.login_failures_id_seq
    START WITH 1
    INCREMENT BY 1
    NO MINVALUE
    NO MAXVALUE
    CACHE 1;
ALTER SEQUENCE public.login_failures_id_seq OWNED BY public.login_failures.id;
CREATE TABLE public.login_links (
    token_hash character varying(64) NOT NULL,
    user_id bigint NOT NULL,
    expires_at character varying(32) NOT NULL
);
CREATE TABLE public.number_counters (
    schema_name character varying(64) NOT NULL,
    category character varying(32) NOT NULL,
    last_serial integer NOT NULL
);
CREATE TABLE public.revisions (
    id bigint NOT NULL,
    item_id bigint NOT NULL,
    revision_number integer NOT NULL,
    properties text NOT NULL,
    comment text NOT NULL,
    status character varying(16) NOT NULL,
    file_name text,
    file_checksum character varying(64),
    file_size bigint,
    thumbnail_key character varying(64),
    idempotency_key character varying(128),
    created_at character varying(32) NOT NULL,
    created_by character varying(64) NOT NULL
);
CREATE SEQUENCE public.revisions_id_seq
    START WITH 1
    INCREMENT BY 1
    NO MINVALUE
    NO MAXVALUE
    CACHE 1;
ALTER SEQUENCE public.revisions_id_seq OWNED BY public.revisions.id;
CREATE TABLE public.server_state (
    key character varying(64) NOT NULL,
    value text NOT NULL
);
CREATE TABLE public.sessions (
    id_hash character varying(64) NOT NULL,
    user_id bigint NOT NULL,
    csrf_token character varying(64) NOT NULL,
    created_at character varying(32) NOT NULL,
    expires_at character varying(32) NOT NULL
);
CREATE TABLE public.users (
    id bigint NOT NULL,
    username character varying(64) NOT NULL,
    username_key character varying(64) NOT NULL,
    display_name text NOT NULL,
    role character varying(16) NOT NULL,
    password_hash text,
    active boolean NOT NULL,
    created_at character varying(32) NOT NULL
);
CREATE SEQUENCE public.users_id_seq
    START WITH 1
    INCREMENT BY 1
    NO MINVALUE
    NO MAXVALUE
    CACHE 1;
ALTER SEQUENCE public.users_id_seq OWNED BY public.users.id;
ALTER TABLE ONLY public.api_tokens ALTER COLUMN id SET DEFAULT nextval('public.api_tokens_id_seq'::regclass);
ALTER TABLE ONLY public.audit ALTER COLUMN id SET DEFAULT nextval('public.audit_id_seq'::regclass);
ALTER TABLE ONLY public.bom_changes ALTER COLUMN id SET DEFAULT nextval('public.bom_changes_id_seq'::regclass);
ALTER TABLE ONLY public.events ALTER COLUMN id SET DEFAULT nextval('public.events_id_seq'::regclass);
ALTER TABLE ONLY public.items ALTER COLUMN id SET DEFAULT nextval('public.items_id_seq'::regclass);
ALTER TABLE ONLY public.login_failures ALTER COLUMN id SET DEFAULT nextval('public.login_failures_id_seq'::regclass);
ALTER TABLE ONLY public.revisions ALTER COLUMN id SET DEFAULT nextval('public.revisions_id_seq'::regclass);
ALTER TABLE ONLY public.users ALTER COLUMN id SET DEFAULT nextval('public.users_id_seq'::regclass);
INSERT INTO public.alembic_version VALUES ('0001');
INSERT INTO public.api_tokens VALUES (1, 1, 'SILO_API_TOKEN', 'aa555d5e7fd295d76f5937b31863bd0d09e9afbbfbbb7013bfdc6775be7ae073', 'silo_rele', '2026-11-22T02:52:53.117079Z', NULL, '2026-11-22T02:52:53.166924Z', NULL);
INSERT INTO public.api_tokens VALUES (2, 1, 'revoked', 'f809fe444f4deb0ce7016e2c494200509641b018551c752d3563e06b92b0a006', 'silo_5b0b', '2026-11-22T02:52:53.484906Z', NULL, NULL, '2026-11-22T02:52:53.489884Z');
INSERT INTO public.audit VALUES (1, '2026-11-22T02:52:53.117079Z', 'system', 'user.created', 'admin', 'role admin', '');
INSERT INTO public.audit VALUES (2, '2026-11-22T02:52:53.117079Z', 'system', 'token.created', 'SILO_API_TOKEN', '', '');
INSERT INTO public.audit VALUES (3, '2026-11-22T02:52:53.168840Z', 'admin', 'user.created', 'zoe', 'role editor', '127.0.0.1');
INSERT INTO public.audit VALUES (4, '2026-11-22T02:52:53.261389Z', 'admin', 'login_link.created', 'zoe', '', '127.0.0.1');
INSERT INTO public.audit VALUES (5, '2026-11-22T02:52:53.265580Z', 'admin', 'mode.set', 'normal', '', '127.0.0.1');
INSERT INTO public.audit VALUES (6, '2026-11-22T02:52:53.373503Z', 'admin', 'login.failed', 'admin', '', '127.0.0.1');
INSERT INTO public.audit VALUES (7, '2026-11-22T02:52:53.478467Z', 'zoe', 'login', '', '', '127.0.0.1');
INSERT INTO public.audit VALUES (8, '2026-11-22T02:52:53.484906Z', 'admin', 'token.created', 'revoked', '', '127.0.0.1');
INSERT INTO public.audit VALUES (9, '2026-11-22T02:52:53.489884Z', 'admin', 'token.revoked', 'revoked', '', '127.0.0.1');
INSERT INTO public.bom_change_lines VALUES (1, '31dfa1e2-9c61-4413-bc90-bdbb451b3daa', 4, 1, 'added', NULL, '{"quantity":2.0,"source":"assembly","rel_type":"component"}');
INSERT INTO public.bom_change_lines VALUES (1, '622ea82c-611b-4194-9368-e8dcd4be2c4a', 5, 2, 'added', NULL, '{"quantity":2.0,"source":"assembly","rel_type":"component"}');
INSERT INTO public.bom_change_lines VALUES (1, 'e6a52007-1952-48a3-8d84-a6cec83d8ef4', 1, 3, 'added', NULL, '{"quantity":8.0,"source":"assembly","rel_type":"component"}');
INSERT INTO public.bom_change_lines VALUES (2, '622ea82c-611b-4194-9368-e8dcd4be2c4a', 5, 2, 'changed', '{"quantity":2.0,"source":"assembly","rel_type":"component"}', '{"quantity":2.0,"source":"assembly","rel_type":"component","unreferenced_since":"2026-11-22T02:52:53.720300Z"}');
INSERT INTO public.bom_change_lines VALUES (2, 'e6a52007-1952-48a3-8d84-a6cec83d8ef4', 1, 3, 'changed', '{"quantity":8.0,"source":"assembly","rel_type":"component"}', '{"quantity":12,"source":"assembly","rel_type":"component"}');
INSERT INTO public.bom_change_lines VALUES (3, '31dfa1e2-9c61-4413-bc90-bdbb451b3daa', 4, 1, 'changed', '{"quantity":2.0,"source":"assembly","rel_type":"component"}', '{"quantity":1.0,"source":"manual","rel_type":"component","override":true,"cad_quantity":2.0}');
INSERT INTO public.bom_change_lines VALUES (5, 'df4cbfbd-dd69-49d9-bb19-5fff37fc2f09', 2, 1, 'added', NULL, '{"quantity":3.0,"source":"assembly","rel_type":"component"}');
INSERT INTO public.bom_change_lines VALUES (5, 'bc5396cf-32a0-47b1-baa3-e36a242b2b64', 7, 2, 'added', NULL, '{"quantity":1.0,"source":"assembly","rel_type":"component"}');
INSERT INTO public.bom_change_lines VALUES (6, '1e04be7d-29e5-48af-9a3d-d4f1c3da3e83', 5, 3, 'added', NULL, '{"quantity":0.5,"source":"manual","rel_type":"component","notes":"glue"}');
INSERT INTO public.bom_changes VALUES (1, 2, 1, 'merge', '2026-11-22T02:52:53.700358Z', 'admin', 'BOM updated: 3 added, 0 quantity changed, 0 unreferenced', NULL, NULL, NULL, NULL, 'first', NULL, NULL);
INSERT INTO public.bom_changes VALUES (2, 2, 2, 'merge', '2026-11-22T02:52:53.720300Z', 'admin', 'BOM updated: 0 added, 1 quantity changed, 1 unreferenced', NULL, NULL, NULL, NULL, 'second', NULL, NULL);
INSERT INTO public.bom_changes VALUES (3, 2, 3, 'edit', '2026-11-22T02:52:53.732579Z', 'admin', 'PRT-100 changed: quantity 2 → 1', NULL, NULL, NULL, NULL, NULL, NULL, NULL);
INSERT INTO public.bom_changes VALUES (4, 2, 3, 'merge', '2026-11-22T02:52:53.742124Z', 'admin', 'BOM updated: 0 added, 0 quantity changed, 1 unreferenced, 1 in conflict', NULL, NULL, NULL, NULL, 'third', NULL, NULL);
INSERT INTO public.bom_changes VALUES (5, 3, 1, 'merge', '2026-11-22T02:52:53.753922Z', 'admin', 'BOM updated: 2 added, 0 quantity changed, 0 unreferenced', NULL, NULL, NULL, NULL, NULL, NULL, NULL);
INSERT INTO public.bom_changes VALUES (6, 3, 2, 'edit', '2026-11-22T02:52:53.765347Z', 'admin', 'PRT-400 added, quantity 0.5', NULL, NULL, NULL, NULL, NULL, NULL, NULL);
INSERT INTO public.bom_conflicts VALUES (2, 4, 2, '2026-11-22T02:52:53.742124Z', false);
INSERT INTO public.bom_lines VALUES ('622ea82c-611b-4194-9368-e8dcd4be2c4a', 2, 5, 2, 'component', 2, NULL, '[]', NULL, NULL, NULL, 'assembly', '2026-11-22T02:52:53.720300Z', false, NULL, NULL, '{}');
INSERT INTO public.bom_lines VALUES ('e6a52007-1952-48a3-8d84-a6cec83d8ef4', 2, 1, 3, 'component', 12, NULL, '[]', NULL, NULL, NULL, 'assembly', NULL, false, NULL, NULL, '{}');
INSERT INTO public.bom_lines VALUES ('31dfa1e2-9c61-4413-bc90-bdbb451b3daa', 2, 4, 1, 'component', 1, NULL, '[]', NULL, NULL, NULL, 'manual', NULL, true, 2, NULL, '{}');
INSERT INTO public.bom_lines VALUES ('df4cbfbd-dd69-49d9-bb19-5fff37fc2f09', 3, 2, 1, 'component', 3, NULL, '[]', NULL, NULL, NULL, 'assembly', NULL, false, NULL, NULL, '{}');
INSERT INTO public.bom_lines VALUES ('bc5396cf-32a0-47b1-baa3-e36a242b2b64', 3, 7, 2, 'component', 1, NULL, '[]', NULL, NULL, NULL, 'assembly', NULL, false, NULL, NULL, '{}');
INSERT INTO public.bom_lines VALUES ('1e04be7d-29e5-48af-9a3d-d4f1c3da3e83', 3, 5, 3, 'component', 0.5, NULL, '[]', NULL, 'glue', NULL, 'manual', NULL, false, NULL, NULL, '{}');
INSERT INTO public.bom_syncs VALUES (2, 'first', 'd85e62493761392e879d128144fe5095f6944d6ceadf1e729eb8fa7df3d29577', '{"status":"merged","diff":{"added":[{"part_number":"PRT-100","quantity":2},{"part_number":"PRT-400","quantity":2},{"part_number":"F01-0001","quantity":8}],"removed":[],"quantity_changed":[],"unchanged":[]},"warnings":[],"resolve_url":"/items/ASM-001/bom","sync_id":"first"}', 1, '2026-11-22T02:52:53.700358Z');
INSERT INTO public.bom_syncs VALUES (2, 'second', 'f6f75943662441d433c757c94063a40292b89f8d0a46825edabbc7ea1ec13c50', '{"status":"merged","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[{"part_number":"F01-0001","old_quantity":8,"new_quantity":12}],"unchanged":[{"part_number":"PRT-100","quantity":2}]},"warnings":[{"type":"unreferenced","part_number":"PRT-400","message":"Present in server BOM but not in assembly"}],"resolve_url":"/items/ASM-001/bom","sync_id":"second"}', 2, '2026-11-22T02:52:53.720300Z');
INSERT INTO public.bom_syncs VALUES (2, 'third', 'f6f75943662441d433c757c94063a40292b89f8d0a46825edabbc7ea1ec13c50', '{"status":"merged","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[],"unchanged":[{"part_number":"F01-0001","quantity":12}]},"warnings":[{"type":"unreferenced","part_number":"PRT-400","message":"Present in server BOM but not in assembly"},{"type":"conflict","part_number":"PRT-100","message":"The assembly has 2, Silo has 1 (set by a person); a person decides","assembly_quantity":2,"server_quantity":1}],"resolve_url":"/items/ASM-001/bom","sync_id":"third"}', 3, '2026-11-22T02:52:53.742124Z');
INSERT INTO public.events VALUES (1, 'server.state', NULL, NULL, '{"mode":"normal"}', '2026-11-22T02:52:53.265580Z');
INSERT INTO public.events VALUES (2, 'item.created', 'c9c1e8b5-873a-4180-af15-0d17d0ab70b9', 'f01-0001', '{"part_number":"F01-0001","id":"c9c1e8b5-873a-4180-af15-0d17d0ab70b9","name":"Screw M4","description":"Screw M4","item_type":"part"}', '2026-11-22T02:52:53.508680Z');
INSERT INTO public.events VALUES (3, 'revision.created', '497b3d43-e2a2-43da-bbeb-32355c90bb15', 'asm-001', '{"part_number":"ASM-001","id":"497b3d43-e2a2-43da-bbeb-32355c90bb15","revision_number":1,"comment":"created","user":"admin"}', '2026-11-22T02:52:53.519653Z');
INSERT INTO public.events VALUES (4, 'item.created', '497b3d43-e2a2-43da-bbeb-32355c90bb15', 'asm-001', '{"part_number":"ASM-001","id":"497b3d43-e2a2-43da-bbeb-32355c90bb15","name":"ASM-001","description":"of ASM-001","item_type":"assembly"}', '2026-11-22T02:52:53.519653Z');
INSERT INTO public.events VALUES (5, 'revision.created', 'df95a954-bc45-4008-a4f8-30afbe055a36', 'asm-top', '{"part_number":"ASM-TOP","id":"df95a954-bc45-4008-a4f8-30afbe055a36","revision_number":1,"comment":"created","user":"admin"}', '2026-11-22T02:52:53.532603Z');
INSERT INTO public.events VALUES (6, 'item.created', 'df95a954-bc45-4008-a4f8-30afbe055a36', 'asm-top', '{"part_number":"ASM-TOP","id":"df95a954-bc45-4008-a4f8-30afbe055a36","name":"ASM-TOP","description":"of ASM-TOP","item_type":"assembly"}', '2026-11-22T02:52:53.532603Z');
INSERT INTO public.events VALUES (7, 'revision.created', 'd229570f-0cda-4511-80c6-428873186c29', 'prt-100', '{"part_number":"PRT-100","id":"d229570f-0cda-4511-80c6-428873186c29","revision_number":1,"comment":"created","user":"admin"}', '2026-11-22T02:52:53.539947Z');
INSERT INTO public.events VALUES (8, 'item.created', 'd229570f-0cda-4511-80c6-428873186c29', 'prt-100', '{"part_number":"PRT-100","id":"d229570f-0cda-4511-80c6-428873186c29","name":"PRT-100","description":"of PRT-100","item_type":"part"}', '2026-11-22T02:52:53.539947Z');
INSERT INTO public.events VALUES (9, 'revision.created', 'fd2f7cbe-4042-4eab-aa48-dd97b43a031e', 'prt-400', '{"part_number":"PRT-400","id":"fd2f7cbe-4042-4eab-aa48-dd97b43a031e","revision_number":1,"comment":"created","user":"admin"}', '2026-11-22T02:52:53.548061Z');
INSERT INTO public.events VALUES (10, 'item.created', 'fd2f7cbe-4042-4eab-aa48-dd97b43a031e', 'prt-400', '{"part_number":"PRT-400","id":"fd2f7cbe-4042-4eab-aa48-dd97b43a031e","name":"PRT-400","description":"of PRT-400","item_type":"part"}', '2026-11-22T02:52:53.548061Z');
INSERT INTO public.events VALUES (11, 'revision.created', 'e9933c12-d51b-40a8-ac5c-3835c7b5a103', 'prt-500', '{"part_number":"PRT-500","id":"e9933c12-d51b-40a8-ac5c-3835c7b5a103","revision_number":1,"comment":"created","user":"admin"}', '2026-11-22T02:52:53.558638Z');
INSERT INTO public.events VALUES (12, 'item.created', 'e9933c12-d51b-40a8-ac5c-3835c7b5a103', 'prt-500', '{"part_number":"PRT-500","id":"e9933c12-d51b-40a8-ac5c-3835c7b5a103","name":"PRT-500","description":"of PRT-500","item_type":"part"}', '2026-11-22T02:52:53.558638Z');
INSERT INTO public.events VALUES (13, 'revision.created', '1c785a2b-5eae-481b-b496-791e14e16cdd', 'ünïcode-7', '{"part_number":"Ünïcode-7","id":"1c785a2b-5eae-481b-b496-791e14e16cdd","revision_number":1,"comment":"created","user":"admin"}', '2026-11-22T02:52:53.566405Z');
INSERT INTO public.events VALUES (14, 'item.created', '1c785a2b-5eae-481b-b496-791e14e16cdd', 'ünïcode-7', '{"part_number":"Ünïcode-7","id":"1c785a2b-5eae-481b-b496-791e14e16cdd","name":"Ünïcode-7","description":"of Ünïcode-7","item_type":"part"}', '2026-11-22T02:52:53.566405Z');
INSERT INTO public.events VALUES (15, 'item.deleted', 'e9933c12-d51b-40a8-ac5c-3835c7b5a103', 'prt-500', '{"part_number":"PRT-500","id":"e9933c12-d51b-40a8-ac5c-3835c7b5a103"}', '2026-11-22T02:52:53.573898Z');
INSERT INTO public.events VALUES (16, 'bom_merge', '497b3d43-e2a2-43da-bbeb-32355c90bb15', 'asm-001', '{"type":"bom_merge","item":"ASM-001","user":"admin","timestamp":"2026-11-22T02:52:53Z","summary":"BOM updated: 3 added, 0 quantity changed, 0 unreferenced","diff":{"added":[{"part_number":"PRT-100","quantity":2},{"part_number":"PRT-400","quantity":2},{"part_number":"F01-0001","quantity":8}],"removed":[],"quantity_changed":[],"unchanged":[]},"resolve_url":"/items/ASM-001/bom","sync_id":"first"}', '2026-11-22T02:52:53.700358Z');
INSERT INTO public.events VALUES (17, 'bom_merge', '497b3d43-e2a2-43da-bbeb-32355c90bb15', 'asm-001', '{"type":"bom_merge","item":"ASM-001","user":"admin","timestamp":"2026-11-22T02:52:53Z","summary":"BOM updated: 0 added, 1 quantity changed, 1 unreferenced","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[{"part_number":"F01-0001","old_quantity":8,"new_quantity":12}],"unchanged":[{"part_number":"PRT-100","quantity":2}]},"resolve_url":"/items/ASM-001/bom","sync_id":"second"}', '2026-11-22T02:52:53.720300Z');
INSERT INTO public.events VALUES (18, 'bom.updated', '497b3d43-e2a2-43da-bbeb-32355c90bb15', 'asm-001', '{"item":"ASM-001","kind":"edit","user":"admin","timestamp":"2026-11-22T02:52:53Z","summary":"PRT-100 changed: quantity 2 → 1"}', '2026-11-22T02:52:53.732579Z');
INSERT INTO public.events VALUES (19, 'bom_merge', '497b3d43-e2a2-43da-bbeb-32355c90bb15', 'asm-001', '{"type":"bom_merge","item":"ASM-001","user":"admin","timestamp":"2026-11-22T02:52:53Z","summary":"BOM updated: 0 added, 0 quantity changed, 1 unreferenced, 1 in conflict","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[],"unchanged":[{"part_number":"F01-0001","quantity":12}]},"resolve_url":"/items/ASM-001/bom","sync_id":"third","warnings":[{"type":"unreferenced","part_number":"PRT-400","message":"Present in server BOM but not in assembly"},{"type":"conflict","part_number":"PRT-100","message":"The assembly has 2, Silo has 1 (set by a person); a person decides","assembly_quantity":2,"server_quantity":1}]}', '2026-11-22T02:52:53.742124Z');
INSERT INTO public.events VALUES (20, 'bom_merge', 'df95a954-bc45-4008-a4f8-30afbe055a36', 'asm-top', '{"type":"bom_merge","item":"ASM-TOP","user":"admin","timestamp":"2026-11-22T02:52:53Z","summary":"BOM updated: 2 added, 0 quantity changed, 0 unreferenced","diff":{"added":[{"part_number":"ASM-001","quantity":3},{"part_number":"Ünïcode-7","quantity":1}],"removed":[],"quantity_changed":[],"unchanged":[]},"resolve_url":"/items/ASM-TOP/bom"}', '2026-11-22T02:52:53.753922Z');
INSERT INTO public.events VALUES (21, 'bom.updated', 'df95a954-bc45-4008-a4f8-30afbe055a36', 'asm-top', '{"item":"ASM-TOP","kind":"edit","user":"admin","timestamp":"2026-11-22T02:52:53Z","summary":"PRT-400 added, quantity 0.5"}', '2026-11-22T02:52:53.765347Z');
INSERT INTO public.events VALUES (22, 'revision.created', 'd229570f-0cda-4511-80c6-428873186c29', 'prt-100', '{"part_number":"PRT-100","id":"d229570f-0cda-4511-80c6-428873186c29","revision_number":2,"comment":"as built","user":"admin"}', '2026-11-22T02:52:53.777548Z');
INSERT INTO public.events VALUES (23, 'revision.created', '497b3d43-e2a2-43da-bbeb-32355c90bb15', 'asm-001', '{"part_number":"ASM-001","id":"497b3d43-e2a2-43da-bbeb-32355c90bb15","revision_number":2,"comment":"as built","user":"admin"}', '2026-11-22T02:52:53.788995Z');
INSERT INTO public.items VALUES (1, 'c9c1e8b5-873a-4180-af15-0d17d0ab70b9', 'F01-0001', 'f01-0001', 'kindred-rd', 'F01', 'part', 'Screw M4', 'Screw M4', 'f01-0001
screw m4
screw m4', NULL, NULL, NULL, '{}', 0, 0, '2026-11-22T02:52:53.508680Z', 'admin', '2026-11-22T02:52:53.508680Z', 'admin', NULL);
INSERT INTO public.items VALUES (5, 'fd2f7cbe-4042-4eab-aa48-dd97b43a031e', 'PRT-400', 'prt-400', 'kindred-rd', NULL, 'part', 'PRT-400', 'of PRT-400', 'prt-400
prt-400
of prt-400', NULL, NULL, NULL, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 1, 0, '2026-11-22T02:52:53.548061Z', 'admin', '2026-11-22T02:52:53.548061Z', 'admin', NULL);
INSERT INTO public.items VALUES (7, '1c785a2b-5eae-481b-b496-791e14e16cdd', 'Ünïcode-7', 'ünïcode-7', 'kindred-rd', NULL, 'part', 'Ünïcode-7', 'of Ünïcode-7', 'ünïcode-7
ünïcode-7
of ünïcode-7', NULL, NULL, NULL, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 1, 0, '2026-11-22T02:52:53.566405Z', 'admin', '2026-11-22T02:52:53.566405Z', 'admin', NULL);
INSERT INTO public.items VALUES (6, 'e9933c12-d51b-40a8-ac5c-3835c7b5a103', 'PRT-500', 'prt-500', 'kindred-rd', NULL, 'part', 'PRT-500', 'of PRT-500', 'prt-500
prt-500
of prt-500', NULL, NULL, NULL, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 1, 0, '2026-11-22T02:52:53.558638Z', 'admin', '2026-11-22T02:52:53.558638Z', 'admin', '2026-11-22T02:52:53.573898Z');
INSERT INTO public.items VALUES (3, 'df95a954-bc45-4008-a4f8-30afbe055a36', 'ASM-TOP', 'asm-top', 'kindred-rd', NULL, 'assembly', 'ASM-TOP', 'of ASM-TOP', 'asm-top
asm-top
of asm-top', NULL, NULL, NULL, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 1, 2, '2026-11-22T02:52:53.532603Z', 'admin', '2026-11-22T02:52:53.532603Z', 'admin', NULL);
INSERT INTO public.items VALUES (4, 'd229570f-0cda-4511-80c6-428873186c29', 'PRT-100', 'prt-100', 'kindred-rd', NULL, 'part', 'PRT-100', 'of PRT-100', 'prt-100
prt-100
of prt-100', NULL, NULL, '93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456', '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 2, 0, '2026-11-22T02:52:53.539947Z', 'admin', '2026-11-22T02:52:53.777548Z', 'admin', NULL);
INSERT INTO public.items VALUES (2, '497b3d43-e2a2-43da-bbeb-32355c90bb15', 'ASM-001', 'asm-001', 'kindred-rd', NULL, 'assembly', 'ASM-001', 'of ASM-001', 'asm-001
asm-001
of asm-001', NULL, NULL, '93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456', '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 2, 3, '2026-11-22T02:52:53.519653Z', 'admin', '2026-11-22T02:52:53.788995Z', 'admin', NULL);
INSERT INTO public.login_failures VALUES (1, 'admin', '127.0.0.1', '2026-11-22T02:52:53.373503Z');
INSERT INTO public.login_links VALUES ('310dba2d7163338a323ce546a854729bd15ae432545640c92c37a269396dd99f', 1, '2026-11-22T03:52:53.117079Z');
INSERT INTO public.login_links VALUES ('1720ecf3f623ee3d3776e8a55384a12bdd03e3358fc5da62508c6e7283ea5620', 2, '2026-11-22T03:52:53.261389Z');
INSERT INTO public.number_counters VALUES ('kindred-rd', 'F01', 1);
INSERT INTO public.revisions VALUES (1, 2, 1, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 'created', 'draft', NULL, NULL, NULL, NULL, NULL, '2026-11-22T02:52:53.519653Z', 'admin');
INSERT INTO public.revisions VALUES (2, 3, 1, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 'created', 'draft', NULL, NULL, NULL, NULL, NULL, '2026-11-22T02:52:53.532603Z', 'admin');
INSERT INTO public.revisions VALUES (3, 4, 1, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 'created', 'draft', NULL, NULL, NULL, NULL, NULL, '2026-11-22T02:52:53.539947Z', 'admin');
INSERT INTO public.revisions VALUES (4, 5, 1, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 'created', 'draft', NULL, NULL, NULL, NULL, NULL, '2026-11-22T02:52:53.548061Z', 'admin');
INSERT INTO public.revisions VALUES (5, 6, 1, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 'created', 'draft', NULL, NULL, NULL, NULL, NULL, '2026-11-22T02:52:53.558638Z', 'admin');
INSERT INTO public.revisions VALUES (6, 7, 1, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 'created', 'draft', NULL, NULL, NULL, NULL, NULL, '2026-11-22T02:52:53.566405Z', 'admin');
INSERT INTO public.revisions VALUES (7, 4, 2, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 'as built', 'draft', 'gear.FCStd', '3f0d2493fca8ed7ee07d300ed774fa029a82b82483e5568d79fc6cfeb7cde452', 305, '93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456', 'k1', '2026-11-22T02:52:53.777548Z', 'admin');
INSERT INTO public.revisions VALUES (8, 2, 2, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 'as built', 'draft', 'gear.FCStd', '3f0d2493fca8ed7ee07d300ed774fa029a82b82483e5568d79fc6cfeb7cde452', 305, '93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456', 'k1', '2026-11-22T02:52:53.788995Z', 'admin');
INSERT INTO public.server_state VALUES ('mode', 'normal');
INSERT INTO public.sessions VALUES ('9a72e1ee2271175c61c6d892fb87d07fd29dcf43c2f186557125fa0f67725b9f', 2, '7dC6CdYDBdznFiZS_xI-hG5QaHl_x3MrgaqYExt_I5U', '2026-11-22T02:52:53.478467Z', '2026-11-23T02:52:53.478467Z');
INSERT INTO public.users VALUES (1, 'admin', 'admin', 'admin', 'admin', NULL, true, '2026-11-22T02:52:53.117079Z');
INSERT INTO public.users VALUES (2, 'zoe', 'zoe', 'zoe', 'editor', '$argon2id$v=19$m=65536,t=3,p=4$687WN/VIcK95anm1HzJrLA$6x0mn7Jd/7lXlIzMt03uLWP0mMcRHW0j7moXzoo8W78', true, '2026-11-22T02:52:53.168840Z');
SELECT pg_catalog.setval('public.api_tokens_id_seq', 2, true);
SELECT pg_catalog.setval('public.audit_id_seq', 9, true);
SELECT pg_catalog.setval('public.bom_changes_id_seq', 6, true);
SELECT pg_catalog.setval('public.events_id_seq', 23, true);
SELECT pg_catalog.setval('public.items_id_seq', 7, true);
SELECT pg_catalog.setval('public.login_failures_id_seq', 1, true);
SELECT pg_catalog.setval('public.revisions_id_seq', 8, true);
SELECT pg_catalog.setval('public.users_id_seq', 2, true);
ALTER TABLE ONLY public.alembic_version
    ADD CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num);
ALTER TABLE ONLY public.api_tokens
    ADD CONSTRAINT pk_api_tokens PRIMARY KEY (id);
ALTER TABLE ONLY public.audit
    ADD CONSTRAINT pk_audit PRIMARY KEY (id);
ALTER TABLE ONLY public.bom_change_lines
    ADD CONSTRAINT pk_bom_change_lines PRIMARY KEY (change_id, line_id);
ALTER TABLE ONLY public.bom_changes
    ADD CONSTRAINT pk_bom_changes PRIMARY KEY (id);
ALTER TABLE ONLY public.bom_conflicts
    ADD CONSTRAINT pk_bom_conflicts PRIMARY KEY (parent_id, child_id);
ALTER TABLE ONLY public.bom_lines
    ADD CONSTRAINT pk_bom_lines PRIMARY KEY (id);
ALTER TABLE ONLY public.bom_syncs
    ADD CONSTRAINT pk_bom_syncs PRIMARY KEY (parent_id, sync_id);
ALTER TABLE ONLY public.events
    ADD CONSTRAINT pk_events PRIMARY KEY (id);
ALTER TABLE ONLY public.items
    ADD CONSTRAINT pk_items PRIMARY KEY (id);
ALTER TABLE ONLY public.login_failures
    ADD CONSTRAINT pk_login_failures PRIMARY KEY (id);
ALTER TABLE ONLY public.login_links
    ADD CONSTRAINT pk_login_links PRIMARY KEY (token_hash);
ALTER TABLE ONLY public.number_counters
    ADD CONSTRAINT pk_number_counters PRIMARY KEY (schema_name, category);
ALTER TABLE ONLY public.revisions
    ADD CONSTRAINT pk_revisions PRIMARY KEY (id);
ALTER TABLE ONLY public.server_state
    ADD CONSTRAINT pk_server_state PRIMARY KEY (key);
ALTER TABLE ONLY public.sessions
    ADD CONSTRAINT pk_sessions PRIMARY KEY (id_hash);
ALTER TABLE ONLY public.users
    ADD CONSTRAINT pk_users PRIMARY KEY (id);
ALTER TABLE ONLY public.api_tokens
    ADD CONSTRAINT uq_api_tokens_token_hash UNIQUE (token_hash);
ALTER TABLE ONLY public.bom_lines
    ADD CONSTRAINT uq_bom_lines_parent_id_child_id_rel_type UNIQUE (parent_id, child_id, rel_type);
ALTER TABLE ONLY public.items
    ADD CONSTRAINT uq_items_part_number_key UNIQUE (part_number_key);
ALTER TABLE ONLY public.items
    ADD CONSTRAINT uq_items_uuid UNIQUE (uuid);
ALTER TABLE ONLY public.revisions
    ADD CONSTRAINT uq_revisions_item_id_idempotency_key UNIQUE (item_id, idempotency_key);
ALTER TABLE ONLY public.revisions
    ADD CONSTRAINT uq_revisions_item_id_revision_number UNIQUE (item_id, revision_number);
ALTER TABLE ONLY public.users
    ADD CONSTRAINT uq_users_username_key UNIQUE (username_key);
CREATE INDEX ix_api_tokens_user_id ON public.api_tokens USING btree (user_id);
CREATE INDEX ix_bom_changes_parent_id_id ON public.bom_changes USING btree (parent_id, id);
CREATE INDEX ix_bom_lines_child_id ON public.bom_lines USING btree (child_id);
CREATE INDEX ix_bom_syncs_at ON public.bom_syncs USING btree (at);
CREATE INDEX ix_login_failures_address_at ON public.login_failures USING btree (address, at);
CREATE INDEX ix_login_failures_username_key_at ON public.login_failures USING btree (username_key, at);
CREATE INDEX ix_revisions_file_checksum ON public.revisions USING btree (file_checksum);
CREATE INDEX ix_sessions_user_id ON public.sessions USING btree (user_id);
ALTER TABLE ONLY public.api_tokens
    ADD CONSTRAINT fk_api_tokens_user_id_users FOREIGN KEY (user_id) REFERENCES public.users(id);
ALTER TABLE ONLY public.bom_change_lines
    ADD CONSTRAINT fk_bom_change_lines_change_id_bom_changes FOREIGN KEY (change_id) REFERENCES public.bom_changes(id);
ALTER TABLE ONLY public.bom_changes
    ADD CONSTRAINT fk_bom_changes_parent_id_items FOREIGN KEY (parent_id) REFERENCES public.items(id);
ALTER TABLE ONLY public.bom_conflicts
    ADD CONSTRAINT fk_bom_conflicts_child_id_items FOREIGN KEY (child_id) REFERENCES public.items(id);
ALTER TABLE ONLY public.bom_conflicts
    ADD CONSTRAINT fk_bom_conflicts_parent_id_items FOREIGN KEY (parent_id) REFERENCES public.items(id);
ALTER TABLE ONLY public.bom_lines
    ADD CONSTRAINT fk_bom_lines_child_id_items FOREIGN KEY (child_id) REFERENCES public.items(id);
ALTER TABLE ONLY public.bom_lines
    ADD CONSTRAINT fk_bom_lines_parent_id_items FOREIGN KEY (parent_id) REFERENCES public.items(id);
ALTER TABLE ONLY public.bom_syncs
    ADD CONSTRAINT fk_bom_syncs_parent_id_items FOREIGN KEY (parent_id) REFERENCES public.items(id);
ALTER TABLE ONLY public.login_links
    ADD CONSTRAINT fk_login_links_user_id_users FOREIGN KEY (user_id) REFERENCES public.users(id);
ALTER TABLE ONLY public.revisions
    ADD CONSTRAINT fk_revisions_item_id_items FOREIGN KEY (item_id) REFERENCES public.items(id);
ALTER TABLE ONLY public.sessions
    ADD CONSTRAINT fk_sessions_user_id_users FOREIGN KEY (user_id) REFERENCES public.users(id);
