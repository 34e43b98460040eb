-- description: What belongs to flows that reached the end of their paths: callback instances,
--     publications, takes, and the requests and responses between them.
-- grain: one row per vertex
-- param: start_ns
-- param: end_ns BIGINT  End of the window of roots, epoch ns
-- param: from, to, via, without
-- param: slowest BIGINT = NULL  So many of the slowest flows; NULL: all
WITH path AS (
    SELECT path_id
    FROM main.flow_path($runs, $from, $to, only_paths := true)
    WHERE ($via IS NOT NULL OR $without IS NOT NULL) AND main.path_visits(path, $via, $without)
),
part AS MATERIALIZED (
    SELECT root_kind, root_id, take_id, callback_instance_id, publication_id
    FROM main.end_to_end_part(
        $runs, $from, $to, 'callback_start', 'callback_end', $start_ns, $end_ns, 'first',
        most_flows := $slowest,
        path_ids := CASE WHEN $via IS NOT NULL OR $without IS NOT NULL
            THEN (SELECT coalesce(list(path_id), []) FROM path) END
    )
),
passed AS MATERIALIZED (
    SELECT
        root_kind AS kind,
        root_id AS id
    FROM part
    UNION
    SELECT 'take', take_id
    FROM part
    UNION
    SELECT 'callback_instance', callback_instance_id
    FROM part
    WHERE callback_instance_id IS NOT NULL
    UNION
    SELECT 'publication', publication_id
    FROM part
    WHERE publication_id IS NOT NULL
),
-- Between two of these.
between_them AS (
    SELECT
        i.to_kind AS kind,
        i.to_id AS id
    FROM derive.flow_link AS i
    JOIN passed AS f ON i.from_kind = f.kind AND i.from_id = f.id
    JOIN derive.flow_link AS o ON i.to_kind = o.from_kind AND i.to_id = o.from_id
    JOIN passed AS t ON o.to_kind = t.kind AND o.to_id = t.id
    WHERE i.to_kind IN ('take', 'request', 'response')
)
SELECT derive.vertex_key(kind, id)::BIGINT AS key FROM passed
UNION
SELECT derive.vertex_key(kind, id)::BIGINT FROM between_them ORDER BY key
