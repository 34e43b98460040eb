-- title: Timing of callbacks
-- description: What an analysis of response times needs of callbacks that ran in an executor. An
--     executor of one thread decides what is ready when a wait ends, and runs each callback at most
--     once before the next wait: one that becomes ready right after that waits for one run of each
--     callback, and then for one of each again, itself included (Blaß, Casini, Bozhko, Brandenburg:
--     A ROS 2 Response-Time Analysis Exploiting Starvation Freedom and Execution-Time Variance,
--     RTSS 2021). With the longest observed runs that bounds its response time, as long as the
--     thread has a CPU and no earlier message of the callback waits.
-- grain: one row per callback that ran in an executor
-- reads: callback_name
-- column: callback_id BIGINT  The callback object
-- column: executor_id BIGINT  Executor that ran it
-- column: kind VARCHAR  Kind of the executor
-- column: threads BIGINT  How many spin it
-- column: node VARCHAR  Node
-- column: callback VARCHAR  What triggers it
-- column: function VARCHAR  Its function; NULL: not known
-- column: callback_group_id BIGINT  Its group; NULL: not known
-- column: group_kind VARCHAR  Kind of that
-- column: period_ns BIGINT [ns]  Period of its timer; NULL: none
-- column: least_ns BIGINT [ns]  Shortest time from one arrival to the next; NULL: it ran once
-- column: instances BIGINT  How often it ran
-- column: run_ns BIGINT[] [ns]  Shortest, 50 %, 95 %, 99 % and longest of its durations
-- column: cpu_ns BIGINT[] [ns]  Likewise of their CPU times; NULL: not known
-- column: observed_ns BIGINT [ns]  Longest time from when it was ready, at the latest, to its end
-- column: observed_most_ns BIGINT [ns]  Likewise at the earliest: with the way of its message
-- column: bound_ns BIGINT [ns]  It is no longer; NULL: several threads, or an events executor
-- column: is_sure BOOLEAN  No earlier message can wait: they come more seldom than the bound
WITH thread AS (
    SELECT
        executor_id,
        count(*) AS threads
    FROM main.executor_thread
    WHERE list_contains($runs, run_id)
    GROUP BY executor_id
),
instance AS (
    SELECT
        w.executor_id, w.callback_id, i.cpu_ns,
        i.end_ns - i.start_ns AS run_ns,
        i.end_ns - coalesce(w.latest_ns, w.start_ns) AS response_ns,
        i.end_ns - coalesce(w.earliest_ns, w.latest_ns, w.start_ns) AS response_most_ns,
        w.latest_ns - lag(w.latest_ns) OVER (
            PARTITION BY w.callback_id ORDER BY w.start_ns
        ) AS after_ns
    FROM main.executor_wait AS w
    JOIN main.callback_instance AS i ON w.callback_instance_id = i.callback_instance_id
    WHERE list_contains($runs, w.run_id) AND i.end_ns IS NOT NULL AND w.executor_id IS NOT NULL
),
measured AS (
    SELECT
        executor_id, callback_id,
        count(*) AS instances,
        quantile_disc(run_ns, [0, 0.5, 0.95, 0.99, 1]) AS run_ns,
        quantile_disc(cpu_ns, [0, 0.5, 0.95, 0.99, 1]) AS cpu_ns,
        min(after_ns) AS least_ns,
        max(response_ns) AS observed_ns,
        max(response_most_ns) AS observed_most_ns,
        2 * sum(max(run_ns)) OVER (PARTITION BY executor_id) AS bound_ns
    FROM instance
    GROUP BY executor_id, callback_id
),
bounded AS (
    SELECT
        m.callback_id, m.executor_id, e.kind, x.threads, m.least_ns, m.instances, m.run_ns,
        m.cpu_ns, m.observed_ns, m.observed_most_ns,
        CASE WHEN x.threads = 1 AND e.kind <> 'events' THEN m.bound_ns END::BIGINT AS bound_ns
    FROM measured AS m
    JOIN thread AS x ON m.executor_id = x.executor_id
    JOIN main.executor AS e ON m.executor_id = e.executor_id
)
SELECT
    b.callback_id, b.executor_id, b.kind, b.threads, n.node, n.callback, n.function,
    g.callback_group_id,
    g.kind AS group_kind,
    t.period_ns, b.least_ns, b.instances, b.run_ns, b.cpu_ns, b.observed_ns,
    b.observed_most_ns, b.bound_ns,
    b.bound_ns <= coalesce(t.period_ns, b.least_ns) AS is_sure
FROM bounded AS b
JOIN callback_name AS n ON b.callback_id = n.callback_id
JOIN main.callback AS c ON b.callback_id = c.callback_id
LEFT JOIN main.timer AS t ON c.timer_id = t.timer_id
LEFT JOIN main.callback_group_member AS m ON b.callback_id = m.callback_id
LEFT JOIN main.callback_group AS g ON m.callback_group_id = g.callback_group_id
ORDER BY b.executor_id, n.node, n.callback, b.callback_id
