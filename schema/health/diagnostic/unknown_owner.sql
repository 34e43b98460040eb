-- name: diagnostic.unknown_owner
-- title: Callbacks of which it is not known what they belong to
-- description: The timer, service or subscription of callbacks that ran is not known.
-- finding: uncertain_owner
-- grain: one row, if there are any
-- severity: warning
-- phase: model
SELECT
    NULL AS trace_id,
    count(*) AS count,
    'callbacks whose timer, service or subscription is not known (no executor events, takes that '
    || 'were not recorded, or loaned messages), in '
    || string_agg(DISTINCT l.label, ', ' ORDER BY l.label) AS detail
FROM staging.callback AS c
JOIN process_label AS l ON c.process_id = l.process_id
WHERE c.kind = 'unknown'
    AND c.callback_id IN (
        SELECT callback_id
        FROM staging.callback_number
        WHERE callback_id IN (SELECT callback_id FROM staging.callback WHERE kind = 'unknown')
    )
HAVING count(*) > 0
