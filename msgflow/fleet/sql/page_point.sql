-- title: Latencies of every path, run by run
-- kind: inline
-- description: Quantiles of the first arrivals of each run, and how many flows began, arrived,
--     and were dropped or lost.
-- grain: one row per path and run
-- column: path, run
-- column: median_ns BIGINT [ns]  Median latency
-- column: p99_ns
-- column: max_ns BIGINT [ns]  Longest latency
-- column: roots BIGINT            Flows that began
-- column: reached BIGINT          Flows that reached the end of the path
-- column: dropped BIGINT          Flows that ended in a full queue
-- column: lost BIGINT             Flows that were lost on the way
SELECT
    f.path, f.run,
    quantile_disc(f.latency_ns, 0.5) FILTER (WHERE f.status = 'reached') AS median_ns,
    quantile_disc(f.latency_ns, 0.99) FILTER (WHERE f.status = 'reached') AS p99_ns,
    max(f.latency_ns) FILTER (WHERE f.status = 'reached') AS max_ns,
    count(*) AS roots,
    count(*) FILTER (WHERE f.status = 'reached') AS reached,
    count(*) FILTER (WHERE f.status = 'dropped') AS dropped,
    count(*) FILTER (WHERE f.status = 'lost') AS lost
FROM flow AS f
JOIN run AS r ON f.run = r.run
WHERE f.is_first IS NOT false
GROUP BY f.path, f.run, r.start_ns
ORDER BY f.path, r.start_ns, f.run
