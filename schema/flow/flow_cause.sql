-- description: Causes of publications, each once, however many annotations declare it.
-- grain: one row per callback instance, or take without one, publication that it led to, and
--     kind of link
SELECT
    run_id, callback_instance_id, take_id, publication_id, kind, candidate_count, is_loss_affected
FROM derive.certain_cause
WHERE annotation_id IS NULL
UNION ALL
SELECT
    run_id, callback_instance_id, take_id, publication_id, kind,
    max(candidate_count),
    bool_or(is_loss_affected)
FROM derive.certain_cause
WHERE annotation_id IS NOT NULL
GROUP BY run_id, callback_instance_id, take_id, publication_id, kind
