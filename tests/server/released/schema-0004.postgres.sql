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
    revoked_at character varying(32),
    scope character varying(8) DEFAULT 'admin'::character varying NOT NULL
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
CREATE TABLE public.bom_last_syncs (
    parent_id bigint NOT NULL,
    at character varying(32),
    username character varying(64) NOT NULL,
    document_file text,
    left_out text NOT NULL,
    components text NOT NULL,
    refused_at character varying(32),
    refusal text
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
    at character varying(32) NOT NULL,
    change_id bigint
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
CREATE TABLE public.item_search (
    item_id bigint NOT NULL,
    words tsvector NOT NULL
);
CREATE TABLE public.items (
    id bigint NOT NULL,
    uuid character varying(36) NOT NULL,
    part_number character varying(64) NOT NULL,
    part_number_key character varying(64) NOT NULL COLLATE pg_catalog."C",
    schema_name character varying(64),
    category character varying(32),
    item_type character varying(32) NOT NULL,
    name text NOT NULL,
    description text NOT NULL,
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
    archived_at character varying(32),
    version integer DEFAULT 1 NOT NULL,
    created_as character varying(64)
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
    expires_at character varying(32) NOT NULL,
    by_link boolean DEFAULT false NOT NULL
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
INSERT INTO public.alembic_version VALUES ('0004');
INSERT INTO public.api_tokens VALUES (1, 1, 'SILO_API_TOKEN', 'aa555d5e7fd295d76f5937b31863bd0d09e9afbbfbbb7013bfdc6775be7ae073', 'silo', '2026-11-22T06:24:07.483845Z', NULL, '2026-11-22T06:24:08.536928Z', NULL, 'admin');
INSERT INTO public.api_tokens VALUES (2, 1, 'revoked', 'd6c1da6a193fdabde60230ad2acf9a4116785a170cf8d558d88fc2457dc04d5b', 'silo_5bdb', '2026-11-22T06:24:09.522580Z', NULL, NULL, '2026-11-22T06:24:09.595199Z', 'admin');
INSERT INTO public.audit VALUES (1, '2026-11-22T06:24:07.483845Z', 'system', 'user.created', 'admin', 'role admin', '');
INSERT INTO public.audit VALUES (2, '2026-11-22T06:24:07.483845Z', 'system', 'token.created', 'SILO_API_TOKEN', '', '');
INSERT INTO public.audit VALUES (3, '2026-11-22T06:24:07.847168Z', 'admin', 'user.created', 'zoe', 'role editor', '127.0.0.1');
INSERT INTO public.audit VALUES (4, '2026-11-22T06:24:08.523945Z', 'admin', 'login_link.created', 'zoe', '', '127.0.0.1');
INSERT INTO public.audit VALUES (5, '2026-11-22T06:24:08.537313Z', 'admin', 'mode.set', 'normal', '', '127.0.0.1');
INSERT INTO public.audit VALUES (6, '2026-11-22T06:24:08.893703Z', 'admin', 'login.failed', 'admin', '', '127.0.0.1');
INSERT INTO public.audit VALUES (7, '2026-11-22T06:24:09.513097Z', 'zoe', 'login', '', '', '127.0.0.1');
INSERT INTO public.audit VALUES (8, '2026-11-22T06:24:09.522580Z', 'admin', 'token.created', 'revoked', '', '127.0.0.1');
INSERT INTO public.audit VALUES (9, '2026-11-22T06:24:09.595199Z', 'admin', 'token.revoked', 'revoked', '', '127.0.0.1');
INSERT INTO public.bom_change_lines VALUES (1, 'e542a708-fd66-40ed-965c-483534ad4b79', 4, 1, 'added', NULL, '{"quantity":2.0,"source":"assembly","rel_type":"component"}');
INSERT INTO public.bom_change_lines VALUES (1, '09a717a4-262b-45bf-ad13-47cbf1b84165', 5, 2, 'added', NULL, '{"quantity":2.0,"source":"assembly","rel_type":"component"}');
INSERT INTO public.bom_change_lines VALUES (1, 'c9e4d941-83d2-4234-bd0e-08349a5dc140', 1, 3, 'added', NULL, '{"quantity":8.0,"source":"assembly","rel_type":"component"}');
INSERT INTO public.bom_change_lines VALUES (2, '09a717a4-262b-45bf-ad13-47cbf1b84165', 5, 2, 'changed', '{"quantity":2.0,"source":"assembly","rel_type":"component"}', '{"quantity":2.0,"source":"assembly","rel_type":"component","unreferenced_since":"2026-11-22T06:24:10.729360Z"}');
INSERT INTO public.bom_change_lines VALUES (2, 'c9e4d941-83d2-4234-bd0e-08349a5dc140', 1, 3, 'changed', '{"quantity":8.0,"source":"assembly","rel_type":"component"}', '{"quantity":12,"source":"assembly","rel_type":"component"}');
INSERT INTO public.bom_change_lines VALUES (3, 'e542a708-fd66-40ed-965c-483534ad4b79', 4, 1, 'changed', '{"quantity":2.0,"source":"assembly","rel_type":"component"}', '{"quantity":1.0,"source":"manual","rel_type":"component","override":true,"cad_quantity":2.0}');
INSERT INTO public.bom_change_lines VALUES (5, '9e090e18-fff9-4a86-97aa-8fbb28204ae1', 2, 1, 'added', NULL, '{"quantity":3.0,"source":"assembly","rel_type":"component"}');
INSERT INTO public.bom_change_lines VALUES (5, '070a9321-06cf-482c-bb73-6a1596f79564', 7, 2, 'added', NULL, '{"quantity":1.0,"source":"assembly","rel_type":"component"}');
INSERT INTO public.bom_change_lines VALUES (6, 'baf8e59b-e145-4ee6-96f9-7118db4b47aa', 5, 3, 'added', NULL, '{"quantity":0.5,"source":"manual","rel_type":"component","notes":"glue"}');
INSERT INTO public.bom_changes VALUES (1, 2, 1, 'merge', '2026-11-22T06:24:10.538574Z', 'admin', 'BOM updated: 3 added, 0 quantity changed, 0 unreferenced', NULL, NULL, NULL, NULL, 'first', NULL, NULL);
INSERT INTO public.bom_changes VALUES (2, 2, 2, 'merge', '2026-11-22T06:24:10.729360Z', 'admin', 'BOM updated: 0 added, 1 quantity changed, 1 unreferenced', NULL, NULL, NULL, NULL, 'second', NULL, NULL);
INSERT INTO public.bom_changes VALUES (3, 2, 3, 'edit', '2026-11-22T06:24:10.746791Z', 'admin', 'PRT-100 changed: quantity 2 → 1', NULL, NULL, NULL, NULL, NULL, NULL, NULL);
INSERT INTO public.bom_changes VALUES (4, 2, 3, 'merge', '2026-11-22T06:24:10.764508Z', 'admin', 'BOM updated: 0 added, 0 quantity changed, 1 unreferenced, 1 in conflict', NULL, NULL, NULL, NULL, 'third', NULL, NULL);
INSERT INTO public.bom_changes VALUES (5, 3, 1, 'merge', '2026-11-22T06:24:10.780701Z', 'admin', 'BOM updated: 2 added, 0 quantity changed, 0 unreferenced', NULL, NULL, NULL, NULL, NULL, NULL, NULL);
INSERT INTO public.bom_changes VALUES (6, 3, 2, 'edit', '2026-11-22T06:24:10.859670Z', 'admin', 'PRT-400 added, quantity 0.5', NULL, NULL, NULL, NULL, NULL, NULL, NULL);
INSERT INTO public.bom_conflicts VALUES (2, 4, 2, '2026-11-22T06:24:10.764508Z', false);
INSERT INTO public.bom_last_syncs VALUES (2, '2026-11-22T06:24:10.764508Z', 'admin', NULL, '[]', '{}', NULL, NULL);
INSERT INTO public.bom_last_syncs VALUES (3, '2026-11-22T06:24:10.780701Z', 'admin', NULL, '[{"reason":"missing","name":"Lid","file":"parts/Lid.FCStd","quantity":2}]', '{}', NULL, NULL);
INSERT INTO public.bom_lines VALUES ('09a717a4-262b-45bf-ad13-47cbf1b84165', 2, 5, 2, 'component', 2, NULL, '[]', NULL, NULL, NULL, 'assembly', '2026-11-22T06:24:10.729360Z', false, NULL, NULL, '{}');
INSERT INTO public.bom_lines VALUES ('c9e4d941-83d2-4234-bd0e-08349a5dc140', 2, 1, 3, 'component', 12, NULL, '[]', NULL, NULL, NULL, 'assembly', NULL, false, NULL, NULL, '{}');
INSERT INTO public.bom_lines VALUES ('e542a708-fd66-40ed-965c-483534ad4b79', 2, 4, 1, 'component', 1, NULL, '[]', NULL, NULL, NULL, 'manual', NULL, true, 2, NULL, '{}');
INSERT INTO public.bom_lines VALUES ('9e090e18-fff9-4a86-97aa-8fbb28204ae1', 3, 2, 1, 'component', 3, NULL, '[]', NULL, NULL, NULL, 'assembly', NULL, false, NULL, NULL, '{}');
INSERT INTO public.bom_lines VALUES ('070a9321-06cf-482c-bb73-6a1596f79564', 3, 7, 2, 'component', 1, NULL, '[]', NULL, NULL, NULL, 'assembly', NULL, false, NULL, NULL, '{}');
INSERT INTO public.bom_lines VALUES ('baf8e59b-e145-4ee6-96f9-7118db4b47aa', 3, 5, 3, 'component', 0.5, NULL, '[]', NULL, 'glue', NULL, 'manual', NULL, false, NULL, NULL, '{}');
INSERT INTO public.bom_syncs VALUES (2, 'first', 'd85e62493761392e879d128144fe5095f6944d6ceadf1e729eb8fa7df3d29577', '{"status":"merged","diff":{"added":[{"part_number":"PRT-100","quantity":2},{"part_number":"PRT-400","quantity":2},{"part_number":"F01-0001","quantity":8}],"removed":[],"quantity_changed":[],"unchanged":[]},"warnings":[],"resolve_url":"/items/ASM-001/bom","sync_id":"first"}', 1, '2026-11-22T06:24:10.538574Z', NULL);
INSERT INTO public.bom_syncs VALUES (2, 'second', 'f6f75943662441d433c757c94063a40292b89f8d0a46825edabbc7ea1ec13c50', '{"status":"merged","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[{"part_number":"F01-0001","old_quantity":8,"new_quantity":12}],"unchanged":[{"part_number":"PRT-100","quantity":2}]},"warnings":[{"type":"unreferenced","part_number":"PRT-400","message":"Present in server BOM but not in assembly"}],"resolve_url":"/items/ASM-001/bom","sync_id":"second"}', 2, '2026-11-22T06:24:10.729360Z', NULL);
INSERT INTO public.bom_syncs VALUES (2, 'third', 'f6f75943662441d433c757c94063a40292b89f8d0a46825edabbc7ea1ec13c50', '{"status":"merged","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[],"unchanged":[{"part_number":"F01-0001","quantity":12}]},"warnings":[{"type":"unreferenced","part_number":"PRT-400","message":"Present in server BOM but not in assembly"},{"type":"conflict","part_number":"PRT-100","message":"The assembly has 2, Silo has 1 (set by a person); a person decides","assembly_quantity":2,"server_quantity":1}],"resolve_url":"/items/ASM-001/bom","sync_id":"third"}', 3, '2026-11-22T06:24:10.764508Z', NULL);
INSERT INTO public.events VALUES (1, 'server.state', NULL, NULL, '{"mode":"normal"}', '2026-11-22T06:24:08.537313Z');
INSERT INTO public.events VALUES (2, 'item.created', '600e4d32-de31-48be-8330-7e75f720868b', 'f01-0001', '{"part_number":"F01-0001","id":"600e4d32-de31-48be-8330-7e75f720868b","name":"Screw M4","description":"Screw M4","item_type":"part"}', '2026-11-22T06:24:10.050980Z');
INSERT INTO public.events VALUES (3, 'revision.created', '72f04af8-24b4-465f-810d-b9a99c56576b', 'asm-001', '{"part_number":"ASM-001","id":"72f04af8-24b4-465f-810d-b9a99c56576b","revision_number":1,"comment":"created","user":"admin"}', '2026-11-22T06:24:10.095984Z');
INSERT INTO public.events VALUES (4, 'item.created', '72f04af8-24b4-465f-810d-b9a99c56576b', 'asm-001', '{"part_number":"ASM-001","id":"72f04af8-24b4-465f-810d-b9a99c56576b","name":"ASM-001","description":"of ASM-001","item_type":"assembly"}', '2026-11-22T06:24:10.095984Z');
INSERT INTO public.events VALUES (5, 'revision.created', '6b82e39b-7e46-4bc7-9a31-fd1ca676cfa6', 'asm-top', '{"part_number":"ASM-TOP","id":"6b82e39b-7e46-4bc7-9a31-fd1ca676cfa6","revision_number":1,"comment":"created","user":"admin"}', '2026-11-22T06:24:10.117418Z');
INSERT INTO public.events VALUES (6, 'item.created', '6b82e39b-7e46-4bc7-9a31-fd1ca676cfa6', 'asm-top', '{"part_number":"ASM-TOP","id":"6b82e39b-7e46-4bc7-9a31-fd1ca676cfa6","name":"ASM-TOP","description":"of ASM-TOP","item_type":"assembly"}', '2026-11-22T06:24:10.117418Z');
INSERT INTO public.events VALUES (7, 'revision.created', '84b40e74-0196-4c99-8cba-e14d260a98ff', 'prt-100', '{"part_number":"PRT-100","id":"84b40e74-0196-4c99-8cba-e14d260a98ff","revision_number":1,"comment":"created","user":"admin"}', '2026-11-22T06:24:10.182178Z');
INSERT INTO public.events VALUES (8, 'item.created', '84b40e74-0196-4c99-8cba-e14d260a98ff', 'prt-100', '{"part_number":"PRT-100","id":"84b40e74-0196-4c99-8cba-e14d260a98ff","name":"PRT-100","description":"of PRT-100","item_type":"part"}', '2026-11-22T06:24:10.182178Z');
INSERT INTO public.events VALUES (9, 'revision.created', '8862fb2e-c15a-4805-82c9-acf5fdecd54d', 'prt-400', '{"part_number":"PRT-400","id":"8862fb2e-c15a-4805-82c9-acf5fdecd54d","revision_number":1,"comment":"created","user":"admin"}', '2026-11-22T06:24:10.362983Z');
INSERT INTO public.events VALUES (10, 'item.created', '8862fb2e-c15a-4805-82c9-acf5fdecd54d', 'prt-400', '{"part_number":"PRT-400","id":"8862fb2e-c15a-4805-82c9-acf5fdecd54d","name":"PRT-400","description":"of PRT-400","item_type":"part"}', '2026-11-22T06:24:10.362983Z');
INSERT INTO public.events VALUES (11, 'revision.created', '73e490f5-b29a-4225-990e-ac856c1ececc', 'prt-500', '{"part_number":"PRT-500","id":"73e490f5-b29a-4225-990e-ac856c1ececc","revision_number":1,"comment":"created","user":"admin"}', '2026-11-22T06:24:10.402232Z');
INSERT INTO public.events VALUES (12, 'item.created', '73e490f5-b29a-4225-990e-ac856c1ececc', 'prt-500', '{"part_number":"PRT-500","id":"73e490f5-b29a-4225-990e-ac856c1ececc","name":"PRT-500","description":"of PRT-500","item_type":"part"}', '2026-11-22T06:24:10.402232Z');
INSERT INTO public.events VALUES (13, 'revision.created', '0d3294e3-5b9e-4c24-886b-c478f17b40c5', 'ünïcode-7', '{"part_number":"Ünïcode-7","id":"0d3294e3-5b9e-4c24-886b-c478f17b40c5","revision_number":1,"comment":"created","user":"admin"}', '2026-11-22T06:24:10.426546Z');
INSERT INTO public.events VALUES (14, 'item.created', '0d3294e3-5b9e-4c24-886b-c478f17b40c5', 'ünïcode-7', '{"part_number":"Ünïcode-7","id":"0d3294e3-5b9e-4c24-886b-c478f17b40c5","name":"Ünïcode-7","description":"of Ünïcode-7","item_type":"part"}', '2026-11-22T06:24:10.426546Z');
INSERT INTO public.events VALUES (15, 'item.deleted', '73e490f5-b29a-4225-990e-ac856c1ececc', 'prt-500', '{"part_number":"PRT-500","id":"73e490f5-b29a-4225-990e-ac856c1ececc"}', '2026-11-22T06:24:10.444953Z');
INSERT INTO public.events VALUES (16, 'bom_merge', '72f04af8-24b4-465f-810d-b9a99c56576b', 'asm-001', '{"type":"bom_merge","item":"ASM-001","user":"admin","timestamp":"2026-11-22T06:24:10Z","summary":"BOM updated: 3 added, 0 quantity changed, 0 unreferenced","diff":{"added":[{"part_number":"PRT-100","quantity":2},{"part_number":"PRT-400","quantity":2},{"part_number":"F01-0001","quantity":8}],"removed":[],"quantity_changed":[],"unchanged":[]},"resolve_url":"/items/ASM-001/bom","sync_id":"first"}', '2026-11-22T06:24:10.538574Z');
INSERT INTO public.events VALUES (17, 'bom_merge', '72f04af8-24b4-465f-810d-b9a99c56576b', 'asm-001', '{"type":"bom_merge","item":"ASM-001","user":"admin","timestamp":"2026-11-22T06:24:10Z","summary":"BOM updated: 0 added, 1 quantity changed, 1 unreferenced","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[{"part_number":"F01-0001","old_quantity":8,"new_quantity":12}],"unchanged":[{"part_number":"PRT-100","quantity":2}]},"resolve_url":"/items/ASM-001/bom","sync_id":"second"}', '2026-11-22T06:24:10.729360Z');
INSERT INTO public.events VALUES (18, 'bom.updated', '72f04af8-24b4-465f-810d-b9a99c56576b', 'asm-001', '{"item":"ASM-001","kind":"edit","user":"admin","timestamp":"2026-11-22T06:24:10Z","summary":"PRT-100 changed: quantity 2 → 1"}', '2026-11-22T06:24:10.746791Z');
INSERT INTO public.events VALUES (19, 'bom_merge', '72f04af8-24b4-465f-810d-b9a99c56576b', 'asm-001', '{"type":"bom_merge","item":"ASM-001","user":"admin","timestamp":"2026-11-22T06:24:10Z","summary":"BOM updated: 0 added, 0 quantity changed, 1 unreferenced, 1 in conflict","diff":{"added":[],"removed":[{"part_number":"PRT-400","quantity":2}],"quantity_changed":[],"unchanged":[{"part_number":"F01-0001","quantity":12}]},"resolve_url":"/items/ASM-001/bom","sync_id":"third","warnings":[{"type":"unreferenced","part_number":"PRT-400","message":"Present in server BOM but not in assembly"},{"type":"conflict","part_number":"PRT-100","message":"The assembly has 2, Silo has 1 (set by a person); a person decides","assembly_quantity":2,"server_quantity":1}]}', '2026-11-22T06:24:10.764508Z');
INSERT INTO public.events VALUES (20, 'bom_merge', '6b82e39b-7e46-4bc7-9a31-fd1ca676cfa6', 'asm-top', '{"type":"bom_merge","item":"ASM-TOP","user":"admin","timestamp":"2026-11-22T06:24:10Z","summary":"BOM updated: 2 added, 0 quantity changed, 0 unreferenced","diff":{"added":[{"part_number":"ASM-001","quantity":3},{"part_number":"Ünïcode-7","quantity":1}],"removed":[],"quantity_changed":[],"unchanged":[]},"resolve_url":"/items/ASM-TOP/bom","left_out":[{"reason":"missing","name":"Lid","file":"parts/Lid.FCStd","quantity":2}]}', '2026-11-22T06:24:10.780701Z');
INSERT INTO public.events VALUES (21, 'bom.updated', '6b82e39b-7e46-4bc7-9a31-fd1ca676cfa6', 'asm-top', '{"item":"ASM-TOP","kind":"edit","user":"admin","timestamp":"2026-11-22T06:24:10Z","summary":"PRT-400 added, quantity 0.5"}', '2026-11-22T06:24:10.859670Z');
INSERT INTO public.events VALUES (22, 'revision.created', '84b40e74-0196-4c99-8cba-e14d260a98ff', 'prt-100', '{"part_number":"PRT-100","id":"84b40e74-0196-4c99-8cba-e14d260a98ff","revision_number":2,"comment":"as built","user":"admin"}', '2026-11-22T06:24:11.011924Z');
INSERT INTO public.events VALUES (23, 'revision.created', '72f04af8-24b4-465f-810d-b9a99c56576b', 'asm-001', '{"part_number":"ASM-001","id":"72f04af8-24b4-465f-810d-b9a99c56576b","revision_number":2,"comment":"as built","user":"admin"}', '2026-11-22T06:24:11.188858Z');
INSERT INTO public.item_search VALUES (1, '''0001'':1A ''001'':1A ''010001'':1A ''10001'':1A ''crew'':2B ''f01'':1A ''f010001'':1A ''m4'':2B,3C ''rew'':2B ''screw'':2B,3C ''screwm4'':3C');
INSERT INTO public.item_search VALUES (3, '''acme'':3C ''asm'':1A,2B,3C ''asmtop'':1A ''mtop'':1A ''of'':3C ''smtop'':1A ''top'':1A,2B,3C ''стaль'':3C');
INSERT INTO public.item_search VALUES (5, '''400'':1A,2B,3C ''acme'':3C ''of'':3C ''ofprt400'':3C ''prt'':1A,2B,3C ''prt400'':1A ''rt400'':1A ''t400'':1A ''стaль'':3C');
INSERT INTO public.item_search VALUES (6, '''500'':1A,2B,3C ''acme'':3C ''of'':3C ''ofprt500'':3C ''prt'':1A,2B,3C ''prt500'':1A ''rt500'':1A ''t500'':1A ''стaль'':3C');
INSERT INTO public.item_search VALUES (7, '''7'':1A,2B,3C ''acme'':3C ''code'':1A,2B ''code7'':1A ''de7'':1A ''icode'':1A,2B ''icode7'':1A ''nicode'':1A,2B ''nicode7'':1A ''ode'':1A,2B ''ode7'':1A ''of'':3C ''ofunicode7'':3C ''unicode'':1A,2B,3C ''unicode7'':1A ''стaль'':3C');
INSERT INTO public.item_search VALUES (4, '''100'':1A,2B,3C ''acme'':3C ''fcstd'':3C ''gear'':3C ''of'':3C ''ofprt100'':3C ''prt'':1A,2B,3C ''prt100'':1A ''rt100'':1A ''t100'':1A ''стaль'':3C');
INSERT INTO public.item_search VALUES (2, '''001'':1A,2B,3C ''acme'':3C ''asm'':1A,2B,3C ''asm001'':1A ''fcstd'':3C ''gear'':3C ''m001'':1A ''of'':3C ''ofasm001'':3C ''sm001'':1A ''стaль'':3C');
INSERT INTO public.items VALUES (1, '600e4d32-de31-48be-8330-7e75f720868b', 'F01-0001', 'f01-0001', 'kindred-rd', 'F01', 'part', 'Screw M4', 'Screw M4', NULL, NULL, NULL, '{}', 0, 0, '2026-11-22T06:24:10.050980Z', 'admin', '2026-11-22T06:24:10.050980Z', 'admin', NULL, 1, NULL);
INSERT INTO public.items VALUES (5, '8862fb2e-c15a-4805-82c9-acf5fdecd54d', 'PRT-400', 'prt-400', 'kindred-rd', NULL, 'part', 'PRT-400', 'of PRT-400', NULL, NULL, NULL, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 1, 0, '2026-11-22T06:24:10.362983Z', 'admin', '2026-11-22T06:24:10.362983Z', 'admin', NULL, 2, 'prt-400');
INSERT INTO public.items VALUES (7, '0d3294e3-5b9e-4c24-886b-c478f17b40c5', 'Ünïcode-7', 'ünïcode-7', 'kindred-rd', NULL, 'part', 'Ünïcode-7', 'of Ünïcode-7', NULL, NULL, NULL, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 1, 0, '2026-11-22T06:24:10.426546Z', 'admin', '2026-11-22T06:24:10.426546Z', 'admin', NULL, 2, 'ünïcode-7');
INSERT INTO public.items VALUES (6, '73e490f5-b29a-4225-990e-ac856c1ececc', 'PRT-500', 'prt-500', 'kindred-rd', NULL, 'part', 'PRT-500', 'of PRT-500', NULL, NULL, NULL, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 1, 0, '2026-11-22T06:24:10.402232Z', 'admin', '2026-11-22T06:24:10.402232Z', 'admin', '2026-11-22T06:24:10.444953Z', 3, 'prt-500');
INSERT INTO public.items VALUES (3, '6b82e39b-7e46-4bc7-9a31-fd1ca676cfa6', 'ASM-TOP', 'asm-top', 'kindred-rd', NULL, 'assembly', 'ASM-TOP', 'of ASM-TOP', NULL, NULL, NULL, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 1, 2, '2026-11-22T06:24:10.117418Z', 'admin', '2026-11-22T06:24:10.117418Z', 'admin', NULL, 2, 'asm-top');
INSERT INTO public.items VALUES (4, '84b40e74-0196-4c99-8cba-e14d260a98ff', 'PRT-100', 'prt-100', 'kindred-rd', NULL, 'part', 'PRT-100', 'of PRT-100', NULL, NULL, '93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456', '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 2, 0, '2026-11-22T06:24:10.182178Z', 'admin', '2026-11-22T06:24:11.011924Z', 'admin', NULL, 3, 'prt-100');
INSERT INTO public.items VALUES (2, '72f04af8-24b4-465f-810d-b9a99c56576b', 'ASM-001', 'asm-001', 'kindred-rd', NULL, 'assembly', 'ASM-001', 'of ASM-001', NULL, NULL, '93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456', '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 2, 3, '2026-11-22T06:24:10.095984Z', 'admin', '2026-11-22T06:24:11.188858Z', 'admin', NULL, 3, 'asm-001');
INSERT INTO public.login_failures VALUES (1, 'admin', '127.0.0.1', '2026-11-22T06:24:08.549460Z');
INSERT INTO public.login_links VALUES ('0afffcfe011a5ebadcb48bc128d29072388f9790729e2fce18972e69cad9aeae', 1, '2026-11-22T07:24:07.483845Z');
INSERT INTO public.login_links VALUES ('b7f3d617dfb3a783848721f6fafbe500c02430ae00afc00897cdea95ad20628d', 2, '2026-11-22T07:24:08.523945Z');
INSERT INTO public.number_counters VALUES ('kindred-rd', 'F01', 1);
INSERT INTO public.revisions VALUES (1, 2, 1, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 'created', 'draft', NULL, NULL, NULL, NULL, NULL, '2026-11-22T06:24:10.095984Z', 'admin');
INSERT INTO public.revisions VALUES (2, 3, 1, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 'created', 'draft', NULL, NULL, NULL, NULL, NULL, '2026-11-22T06:24:10.117418Z', 'admin');
INSERT INTO public.revisions VALUES (3, 4, 1, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 'created', 'draft', NULL, NULL, NULL, NULL, NULL, '2026-11-22T06:24:10.182178Z', 'admin');
INSERT INTO public.revisions VALUES (4, 5, 1, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 'created', 'draft', NULL, NULL, NULL, NULL, NULL, '2026-11-22T06:24:10.362983Z', 'admin');
INSERT INTO public.revisions VALUES (5, 6, 1, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 'created', 'draft', NULL, NULL, NULL, NULL, NULL, '2026-11-22T06:24:10.402232Z', 'admin');
INSERT INTO public.revisions VALUES (6, 7, 1, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 'created', 'draft', NULL, NULL, NULL, NULL, NULL, '2026-11-22T06:24:10.426546Z', 'admin');
INSERT INTO public.revisions VALUES (7, 4, 2, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 'as built', 'draft', 'gear.FCStd', '5288a7612c762bfcfd08d2ef0c233fd0ca8ea1f7a7cfe50cd196bcb597e5321e', 305, '93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456', 'k1', '2026-11-22T06:24:11.011924Z', 'admin');
INSERT INTO public.revisions VALUES (8, 2, 2, '{"mass_kg":0.25,"standard_cost":3.1,"material":"Стaль","Supplier":"ACME"}', 'as built', 'draft', 'gear.FCStd', '5288a7612c762bfcfd08d2ef0c233fd0ca8ea1f7a7cfe50cd196bcb597e5321e', 305, '93497ee4808a75d08c0cef2583b1a78511253a7bf06a909fb489a0a32d9e3456', 'k1', '2026-11-22T06:24:11.188858Z', 'admin');
INSERT INTO public.server_state VALUES ('search_index', '1');
INSERT INTO public.server_state VALUES ('housekeeping_of_files', '1795328647.674497');
INSERT INTO public.server_state VALUES ('housekeeping', '{"at":"2026-11-22T06:24:07.655592Z","seconds":0.025,"removed":{},"problem":null}');
INSERT INTO public.server_state VALUES ('mode', 'normal');
INSERT INTO public.sessions VALUES ('aa5010317fe6d296d7cd73cf5b5fad291615179547a5730b72929e5ad98f4d8e', 2, '7BrhSEA5lNCKcG3alz6skwF3krt-y9-U-RHADPUOlNE', '2026-11-22T06:24:09.513097Z', '2026-11-23T06:24:09.513097Z', false);
INSERT INTO public.users VALUES (1, 'admin', 'admin', 'admin', 'admin', NULL, true, '2026-11-22T06:24:07.483845Z');
INSERT INTO public.users VALUES (2, 'zoe', 'zoe', 'zoe', 'editor', '$argon2id$v=19$m=65536,t=3,p=4$d7b0jxJB/cvYwtBphzgiJw$d5t3MjNOZJ2jbr2G/MYhNzSAJQqLABUfOLxof4/F5XQ', true, '2026-11-22T06:24:07.847168Z');
SELECT pg_catalog.setval('public.api_tokens_id_seq', 2, true);
SELECT pg_catalog.setval('public.audit_id_seq', 9, true);
SELECT pg_catalog.setval('public.bom_changes_id_seq', 6, true);
SELECT pg_catalog.setval('public.events_id_seq', 23, true);
SELECT pg_catalog.setval('public.items_id_seq', 7, true);
SELECT pg_catalog.setval('public.login_failures_id_seq', 2, true);
SELECT pg_catalog.setval('public.revisions_id_seq', 8, true);
SELECT pg_catalog.setval('public.users_id_seq', 2, true);
ALTER TABLE ONLY public.alembic_version
    ADD CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num);
ALTER TABLE ONLY public.item_search
    ADD CONSTRAINT item_search_pkey PRIMARY KEY (item_id);
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
ALTER TABLE ONLY public.bom_last_syncs
    ADD CONSTRAINT pk_bom_last_syncs PRIMARY KEY (parent_id);
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
CREATE INDEX ix_item_search_words ON public.item_search USING gin (words);
CREATE INDEX ix_items_archived_at_part_number_key ON public.items USING btree (archived_at, part_number_key);
CREATE INDEX ix_items_category_archived_at_part_number_key ON public.items USING btree (category, archived_at, part_number_key);
CREATE INDEX ix_items_item_type_archived_at_part_number_key ON public.items USING btree (item_type, archived_at, part_number_key);
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
ALTER TABLE ONLY public.bom_last_syncs
    ADD CONSTRAINT fk_bom_last_syncs_parent_id_items FOREIGN KEY (parent_id) REFERENCES public.items(id);
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
