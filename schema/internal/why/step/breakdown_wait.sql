-- title: Waits of callbacks, as a breakdown needs them
-- description: The step breakdown_wait of path-breakdown, from waits that are explained already.
-- grain: one row per callback instance that waited
-- reads: explained_wait
SELECT callback_instance_id, executor_id, busy_min_ns, busy_max_ns, held_max_ns
FROM explained_wait
