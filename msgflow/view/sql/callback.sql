-- description: The callbacks of a run, each with its subscription, timer or service.
-- grain: one row per callback
-- column: callback_id
-- column: kind VARCHAR  'timer', 'subscription', 'service' or 'unknown'
-- column: subscription_id
-- column: timer_id BIGINT  Its timer
-- column: service_id BIGINT  Its service
SELECT callback_id, kind, subscription_id, timer_id, service_id
FROM main.callback
WHERE run_id = $run
ORDER BY callback_id
