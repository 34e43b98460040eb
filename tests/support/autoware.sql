-- What became of each /FrontLidarDriver message at /VehicleDBWSystem, by run; of $margin_ns at the
-- begin and the end of each run nothing is said, where flows begin before or go on after it.
WITH window_of AS (
    SELECT run_id, name, start_ns + $margin_ns AS from_ns, end_ns - $margin_ns AS until_ns
    FROM main.run
    WHERE list_contains($runs, run_id)
),
arrival AS (
    SELECT
        e.run_id,
        e.root_id,
        e.take_id,
        e.latency_ns,
        list_sort(list_distinct(list(
            h.topics[list_position(h.topics, '/BehaviorPlanner') - 1]
        ))) AS branches
    FROM main.end_to_end(
        $runs, '/FrontLidarDriver', '/VehicleInterface', 'callback_start', 'callback_end',
        0, 9223372036854775807
    ) AS e
    JOIN main.flow_path($runs, '/FrontLidarDriver', '/VehicleInterface') AS h
        ON e.path_id = h.path_id
    JOIN window_of AS w ON e.run_id = w.run_id
    WHERE e.status = 'reached' AND e.root_ns BETWEEN w.from_ns AND w.until_ns
    GROUP BY e.run_id, e.root_id, e.take_id, e.latency_ns
),
root AS (
    SELECT
        run_id,
        root_id,
        count(*) AS messages,
        min(latency_ns) AS first_ns,
        max(latency_ns) AS last_ns,
        array_to_string(list_transform(
            list(branches ORDER BY latency_ns), lambda each: array_to_string(each, ' + ')
        ), ' | ') AS branches
    FROM arrival
    GROUP BY run_id, root_id
),
usual AS (
    SELECT run_id, mode(messages) AS messages FROM root GROUP BY run_id
)
SELECT
    w.name,
    w.from_ns,
    w.until_ns,
    count(*) AS roots,
    histogram(r.messages) AS messages,
    quantile_disc(r.first_ns, [0.0, 0.5, 1.0]) AS first_ns,
    quantile_disc(r.last_ns, [0.0, 0.5, 1.0]) AS last_ns,
    mode(r.branches) FILTER (WHERE r.messages = u.messages) AS usual_branches
FROM root AS r
JOIN usual AS u ON r.run_id = u.run_id
JOIN window_of AS w ON r.run_id = w.run_id
GROUP BY w.run_id, w.name, w.from_ns, w.until_ns
ORDER BY w.run_id
