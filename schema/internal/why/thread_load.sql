-- title: How much executors are asked for
-- description: How much of the time of the threads of an executor its callbacks need: how often
--     timers are due and messages come, times how long a callback takes as a rule.
-- grain: one row per executor and callback
-- reads: callback_name, callback_use, delivery, explained_wait
-- column: executor_id BIGINT  The executor
-- column: node VARCHAR  Node of the callback
-- column: callback VARCHAR  What triggers it
-- column: per_take DOUBLE  Messages that come for each that it takes; NULL: not known
-- column: demand DOUBLE  Share of one thread that it needs; of several objects, each
-- column: load DOUBLE  Share that all callbacks need, of all threads
-- column: largest DOUBLE  The largest one of a callback, of all threads
-- column: alike BIGINT  Callbacks that need at least half of the largest
WITH member AS (
    SELECT DISTINCT w.executor_id, w.callback_id
    FROM explained_wait AS w
),
-- One may be on its way when the recording ends.
heard AS (
    SELECT
        subscription_id,
        sum(delivered + dropped + greatest(cut_by_recording - 1, 0)) / nullif(sum(delivered), 0)
            AS per_take
    FROM delivery
    GROUP BY subscription_id
),
asked AS (
    SELECT
        m.executor_id, n.node, n.callback,
        coalesce(
            sum(u.usual_ns / nullif(t.period_ns, 0)),
            max(
                u.usual_ns * u.instances * coalesce(h.per_take, 1)
                / nullif(u.last_ns - u.first_ns, 0)
            ),
            0
        ) AS demand,
        max(h.per_take) AS per_take,
        count(DISTINCT m.callback_id) AS callbacks
    FROM member AS m
    JOIN callback_name AS n ON m.callback_id = n.callback_id
    JOIN callback_use AS u ON n.node = u.node AND n.callback = u.callback
    JOIN main.callback AS c ON m.callback_id = c.callback_id
    LEFT JOIN main.timer AS t ON c.timer_id = t.timer_id
    LEFT JOIN heard AS h ON c.subscription_id = h.subscription_id
    GROUP BY m.executor_id, n.node, n.callback
)
SELECT
    a.executor_id, a.node, a.callback, a.per_take,
    a.each_demand AS demand,
    sum(a.demand) OVER each / s.threads AS load,
    a.largest_demand / s.threads AS largest,
    (sum(a.callbacks) FILTER (WHERE 2 * a.each_demand >= a.largest_demand) OVER each)::BIGINT
    AS alike
FROM (
    SELECT
        *,
        demand / callbacks AS each_demand,
        max(demand / callbacks) OVER (PARTITION BY executor_id) AS largest_demand
    FROM asked
) AS a
JOIN (
    SELECT
        executor_id,
        count(*) AS threads
    FROM main.executor_thread
    GROUP BY executor_id
) AS s
    ON a.executor_id = s.executor_id
WINDOW each AS (PARTITION BY a.executor_id)
