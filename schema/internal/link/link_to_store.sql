-- description: The links of a file as annotations, each once, from `matched`: nodes and topics that
--     its entries mean. One that the trace declares, too, is not stored again.
-- grain: one row per link of a node
-- reads: matched
-- column: annotation_id BIGINT  Its identity; NULL: the trace declares it
-- column: kind VARCHAR          Kind of link
-- column: process_id BIGINT     Process of the node
-- column: inputs BIGINT[]       Its subscriptions
-- column: outputs BIGINT[]      Its publishers
-- column: depth BIGINT          Of a queue: most messages that wait in it
WITH link AS (
    SELECT
        kind, process_id, inputs, outputs,
        min(place) AS place,
        last(depth ORDER BY place) AS depth
    FROM (
        SELECT
            *,
            row_number() OVER () AS place
        FROM matched
    )
    GROUP BY kind, process_id, inputs, outputs
),
added AS (
    SELECT
        *,
        -- No key of an earlier file: one transaction cannot use a key twice.
        (SELECT coalesce(max(annotation_id), 0) FROM store.annotation)
        + row_number() OVER (ORDER BY place) AS annotation_id
    FROM link AS l
    WHERE NOT EXISTS (
        FROM traced_annotation AS d
        WHERE d.kind = l.kind AND d.process_id = l.process_id
            AND coalesce(d.inputs, []) = l.inputs AND coalesce(d.outputs, []) = l.outputs
    )
)
SELECT a.annotation_id, l.kind, l.process_id, l.inputs, l.outputs, l.depth
FROM link AS l
LEFT JOIN added AS a ON l.place = a.place
ORDER BY l.place
