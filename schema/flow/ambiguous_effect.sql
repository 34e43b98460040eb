-- description: Takes and publications that flows reach by a link that may be another one.
-- grain: one row per take or publication
SELECT
    run_id,
    'take' AS kind,
    take_id AS id,
    candidate_count
FROM store.link_transport
WHERE candidate_count > 1
UNION ALL
SELECT
    run_id, 'publication', publication_id,
    max(candidate_count)
FROM derive.flow_cause
WHERE candidate_count > 1
GROUP BY run_id, publication_id
