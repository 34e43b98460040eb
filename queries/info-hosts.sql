-- title: Machines and containers
-- description: The hosts of a run, and how their clocks were brought together.
-- grain: one row per host
-- column: run_id
-- column: hostname VARCHAR [host]  Name of the host
-- column: trace_count BIGINT                  Traces recorded on it
-- column: process_count BIGINT                Processes seen on it
-- column: clock_method VARCHAR                How its clock was corrected; none: as recorded
-- column: clock_uncertainty_ns BIGINT [ns]    Bound of the error of that correction
SELECT
    host.run_id, host.hostname,
    (SELECT count(*) FROM main.trace WHERE trace.host_id = host.host_id) AS trace_count,
    (SELECT count(*) FROM main.process WHERE process.host_id = host.host_id) AS process_count,
    clock.method AS clock_method,
    clock.uncertainty_ns AS clock_uncertainty_ns
FROM main.host
JOIN main.clock ON clock.clock_id = host.clock_id
WHERE list_contains($runs, host.run_id)
ORDER BY host.run_id, host.hostname, host.host_id
