-- description: Values that hold until the next one: the rate of each publisher, from one message to
--     the next, and 0 after the last; how many messages of each subscription were published and not
--     yet taken, of those that it took later; CPUs that each program used (main.program_cpu), those
--     without ROS by their names, if they used a tenth of a CPU at some time.
-- grain: one row per value
-- param: runs
-- param: window_start_ns BIGINT  From this moment on, epoch ns; queues and CPUs begin with what
--     holds then
-- param: window_end_ns BIGINT  Only before this moment, epoch ns
-- column: run_id
-- column: kind VARCHAR  'rate', 'queue' or 'cpu'
-- column: host_id BIGINT  Machine or container
-- column: process_id BIGINT  The process; NULL: a program without ROS
-- column: object_id BIGINT  Publisher, subscription, or the process
-- column: name VARCHAR  Topic, or program
-- column: at_ns BIGINT [epoch ns]  From when on
-- column: value DOUBLE  Hz, messages, or CPUs
-- column: place BIGINT  Order of values of one moment
CREATE OR REPLACE MACRO main.counter(runs, window_start_ns, window_end_ns) AS TABLE
WITH message AS (
    SELECT
        publisher_id,
        start_ns AS at_ns,
        lead(start_ns) OVER (PARTITION BY publisher_id ORDER BY start_ns, publication_id) - start_ns
            AS period_ns
    FROM main.publication
    WHERE list_contains(runs, run_id)
),
step AS (
    SELECT
        t.subscription_id, t.take_id,
        unnest([greatest(b.end_ns, window_start_ns), t.taken_ns]) AS at_ns,
        unnest([1, -1]) AS step
    FROM main.link_transport AS l
    JOIN main.publication AS b ON l.publication_id = b.publication_id
    JOIN main.take AS t ON l.take_id = t.take_id
    WHERE list_contains(runs, l.run_id)
        AND t.taken_ns >= b.end_ns
        AND t.taken_ns >= window_start_ns
        AND b.end_ns < window_end_ns
),
used AS (
    SELECT
        run_id, host_id, process_id, program, start_ns, end_ns,
        sum(cpu_ns) / (end_ns - start_ns) AS cpus
    FROM main.program_cpu(runs)
    GROUP BY run_id, host_id, process_id, program, start_ns, end_ns
    QUALIFY process_id IS NOT NULL
        OR max(cpus) OVER (PARTITION BY run_id, host_id, program) >= 0.1
),
usage AS (
    SELECT
        run_id, host_id, process_id, program,
        greatest(start_ns, window_start_ns) AS at_ns,
        cpus
    FROM used
    WHERE end_ns > window_start_ns
    UNION ALL
    SELECT run_id, host_id, process_id, program, end_ns, 0
    FROM used
    QUALIFY lead(start_ns) OVER (
        PARTITION BY run_id, host_id, process_id, program ORDER BY start_ns
    ) IS DISTINCT FROM end_ns
),
counted AS (
    SELECT
        o.run_id,
        'rate' AS kind,
        NULL::BIGINT AS host_id,
        o.process_id,
        o.publisher_id AS object_id,
        o.topic_name AS name,
        m.at_ns,
        coalesce(1e9 / m.period_ns, 0) AS value,
        0 AS place
    FROM message AS m
    JOIN main.publisher AS o ON m.publisher_id = o.publisher_id
    WHERE m.period_ns IS DISTINCT FROM 0
    UNION ALL
    SELECT
        o.run_id, 'queue', NULL, o.process_id, s.subscription_id, o.topic_name, s.at_ns,
        sum(s.step) OVER so_far,
        row_number() OVER so_far
    FROM step AS s
    JOIN main.subscription AS o ON s.subscription_id = o.subscription_id
    WINDOW so_far AS (
        PARTITION BY s.subscription_id
        ORDER BY s.at_ns, s.step DESC, s.take_id
        ROWS UNBOUNDED PRECEDING
    )
    UNION ALL
    SELECT run_id, 'cpu', host_id, process_id, process_id, program, at_ns, cpus, 0
    FROM usage
)
SELECT
    c.run_id, c.kind,
    coalesce(c.host_id, p.host_id) AS host_id,
    c.process_id, c.object_id,
    coalesce(c.name, '?') AS name,
    c.at_ns, c.value, c.place
FROM counted AS c
LEFT JOIN main.process AS p ON c.process_id = p.process_id
WHERE c.at_ns >= window_start_ns AND c.at_ns < window_end_ns
