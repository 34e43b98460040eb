-- title: Messages to replay
-- description: Which message came to which subscription, which callback instance got it, and when
--     it came, as far as the trace tells. One that a full queue dropped, or that was not taken any
--     more, came, too.
-- grain: one row per publication and subscription that it came to
SELECT
    d.publication_id, d.subscription_id, i.callback_instance_id,
    CASE WHEN a.is_exact THEN a.arrived_ns END AS arrived_ns
FROM main.stat_delivery AS d
LEFT JOIN main.callback_instance AS i ON d.take_id = i.take_id
LEFT JOIN main.arrival AS a ON d.take_id = a.take_id
WHERE d.run_id = $run_id
    AND (d.take_id IS NOT NULL OR d.reason IN ('overwritten', 'pending_at_end'))
ORDER BY d.publication_id, d.subscription_id
