-- title: Runs in the database
-- description: What was ingested, when, and how much of it the tracer lost.
-- grain: one row per run
-- variant: section VARCHAR {runs|hosts|processes|nodes|counts|findings|quality} = 'runs'  What to
--     list: runs, hosts, processes, nodes, rows per table, findings, or what share of the answers
--     defects affect
-- column: run_id
-- column: name
-- column: start_ns BIGINT [epoch ns]     First event
-- column: end_ns BIGINT [epoch ns]       Last event
-- column: duration_ns BIGINT [ns]        Time between them
-- column: trace_count BIGINT             CTF traces read
-- column: event_count
-- column: discarded_event_count BIGINT   Events that the tracer could not record
-- column: msgflow_version VARCHAR        Version of msgflow that read it
-- column: labels VARCHAR[]               What users say of it (msgflow runs label), NULL: nothing
-- brief: run_id, name, labels, start_ns, duration_ns, event_count, discarded_event_count,
--     trace_count, end_ns, msgflow_version
WITH run_trace AS (
    SELECT
        run_id,
        count(*) AS trace_count,
        CAST(sum(event_count) AS BIGINT) AS event_count,
        CAST(least(coalesce(sum(discarded_event_count), 0), 9007199254740992) AS BIGINT)
            AS discarded_event_count
    FROM main.trace
    GROUP BY run_id
)
SELECT
    run.run_id, run.name, run.start_ns, run.end_ns,
    run.end_ns - run.start_ns AS duration_ns,
    coalesce(run_trace.trace_count, 0) AS trace_count,
    coalesce(run_trace.event_count, 0) AS event_count,
    coalesce(run_trace.discarded_event_count, 0) AS discarded_event_count,
    run.msgflow_version, run.labels
FROM main.run
LEFT JOIN run_trace ON run_trace.run_id = run.run_id
WHERE list_contains($runs, run.run_id)
ORDER BY run.run_id
