-- name: finding.uncertain_owner
-- title: The owner of callbacks was deduced, or is not known
-- description: Callbacks ran whose creation is not in the trace. The timer, service or subscription
--     that they belong to was deduced from how the executor ran them, or is not known.
-- cause: The session was started after the nodes, or the events of initialisation were not enabled
--     or lost.
-- cure: Start the session first, or record initialisation into a snapshot session that runs all the
--     time, and ingest both. Enable ros2:*, so that takes and executors show.
-- grain: one row per way in which it is uncertain
-- severity: warning
-- phase: model
SELECT run_id, 'the input' AS subject, count, detail
FROM main.diagnostic
WHERE name IN ('eliminated_owner', 'unknown_owner', 'ambiguous_buffer')
