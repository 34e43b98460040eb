-- description: The runs of the database, or one of them, and how much of the timeline each has.
-- grain: one row per run
-- column: run_id BIGINT  Identity of the run
-- column: name VARCHAR  Its name
-- column: start_text VARCHAR  First event, epoch ns in digits: too long for a number of a browser
-- column: length BIGINT [ns]  From the first event to the last
-- column: event_count
-- column: host_count BIGINT  Machines and containers
-- column: msgflow_version VARCHAR  Version that read it
SELECT
    r.run_id, r.name,
    r.start_ns::VARCHAR AS start_text,
    r.end_ns - r.start_ns AS length,
    (SELECT sum(event_count)::BIGINT FROM main.trace AS t WHERE t.run_id = r.run_id)
        AS event_count,
    (SELECT count(*) FROM main.host AS h WHERE h.run_id = r.run_id) AS host_count,
    r.msgflow_version
FROM main.run AS r
WHERE $run IS NULL OR r.run_id = $run
ORDER BY r.run_id
