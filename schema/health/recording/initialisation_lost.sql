-- title: Events of initialisation were lost
-- description: Objects were used whose creation is not in the trace, and the trace lost events at
--     the time when their process started. These objects are placeholders with no name, or with one
--     deduced from messages. So topics and nodes are missing from results.
-- cause: The buffers were full while the process started, which is when it records most; or packets
--     of that time are missing.
-- cure: Record with larger sub-buffers (see discarded_events), or in discard mode if packets were
--     overwritten; or record initialisation into a snapshot session that runs all the time, and
--     ingest both.
-- grain: one row per process
-- severity: warning
-- when: store.gap
SELECT p.run_id, u.process_id, u.count, u.detail
FROM derive.unseen_creation AS u
JOIN main.process AS p ON u.process_id = p.process_id
WHERE u.is_lossy
