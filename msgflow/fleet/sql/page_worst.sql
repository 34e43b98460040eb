-- title: The slowest flows of every path
-- description: Flows that reached the end, by their first arrival.
-- grain: one row per flow
-- param: count BIGINT {1..} = 10  Most rows of a path
-- column: path, run, latency_ns
-- column: at_ns BIGINT [ns]       Start of the root, since the start of the run
-- column: root_kind
-- column: root_id BIGINT  Identity of the root in the database of the run
SELECT f.path, f.run, f.latency_ns, f.root_ns - r.start_ns AS at_ns, f.root_kind, f.root_id
FROM flow AS f
JOIN run AS r ON f.run = r.run
WHERE f.is_first AND f.status = 'reached'
QUALIFY row_number() OVER (
    PARTITION BY f.path ORDER BY f.latency_ns DESC, f.run, f.root_id
) <= $count
ORDER BY f.path, f.latency_ns DESC, f.run, f.root_id
