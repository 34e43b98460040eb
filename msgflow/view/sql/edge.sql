-- description: Links of a run whose ends begin in a window, for a page without a database to follow
--     flows by: the same as main.flow_both follows.
-- grain: one row per link
-- column: to_kind UTINYINT  Effect, as in bar.sql
-- column: to_id BIGINT  Its identity
-- column: from_kind UTINYINT  Cause
-- column: from_id BIGINT  Its identity
-- column: link_kind
WITH held AS (SELECT kind, id FROM segment WHERE kind < 5),
coded AS (
    SELECT
        t.code AS to_kind,
        l.to_id,
        f.code AS from_kind,
        l.from_id, l.link_kind
    FROM main.flow_edge AS l
    JOIN vertex_code AS f ON l.from_kind = f.name
    JOIN vertex_code AS t ON l.to_kind = t.name
    WHERE l.run_id = $run
)
SELECT to_kind, to_id, from_kind, from_id, link_kind
FROM coded AS c
WHERE EXISTS (SELECT 1 FROM held AS h WHERE h.kind = c.to_kind AND h.id = c.to_id)
    OR EXISTS (SELECT 1 FROM held AS h WHERE h.kind = c.from_kind AND h.id = c.from_id)
ORDER BY from_kind, to_kind, from_id, to_id, link_kind
