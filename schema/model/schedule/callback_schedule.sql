-- name: staging.callback_schedule
-- description: How the time of callback instances divides into states of their threads, from sums
--     of the states up to their begin and up to their end.
-- grain: one row per callback instance that ended, on a thread with known states
-- when: staging.thread_state
-- column: callback_instance_id BIGINT  The callback instance
-- column: running_ns BIGINT [ns]  On a CPU
-- column: preempted_ns BIGINT [ns]  Ready, but another thread had the CPU
-- column: runnable_ns BIGINT [ns]  Woken, waiting for a CPU
-- column: sleeping_ns BIGINT [ns]  Waiting for something
-- column: uninterruptible_ns BIGINT [ns]  Waiting for a page or a disk
-- column: unknown_ns BIGINT [ns]  Not known
-- column: preemption_count BIGINT  How often it lost the CPU
-- column: migration_count BIGINT  How often it went on on another CPU
-- column: is_loss_affected BOOLEAN  Kernel events were lost meanwhile
WITH run AS (
    SELECT
        thread_id, start_ns,
        coalesce(cpu <> lag(cpu) OVER (PARTITION BY thread_id ORDER BY start_ns), false)
            AS is_migration
    FROM staging.thread_state
    WHERE state = 'running'
),
state AS (
    SELECT
        s.thread_id, s.start_ns, s.end_ns, s.state, s.end_ns - s.start_ns AS length_ns,
        coalesce(r.is_migration, false) AS is_migration, s.is_loss_affected
    FROM staging.thread_state AS s
    LEFT JOIN run AS r
        ON s.thread_id = r.thread_id AND s.start_ns = r.start_ns AND s.state = 'running'
),
-- Sums up to the end of each state.
total AS (
    SELECT
        thread_id, start_ns, end_ns, state, is_loss_affected,
        sum(length_ns) FILTER (WHERE state = 'running') OVER earlier AS running_ns,
        sum(length_ns) FILTER (WHERE state = 'preempted') OVER earlier AS preempted_ns,
        sum(length_ns) FILTER (WHERE state = 'runnable') OVER earlier AS runnable_ns,
        sum(length_ns) FILTER (WHERE state = 'sleeping') OVER earlier AS sleeping_ns,
        sum(length_ns) FILTER (WHERE state = 'uninterruptible') OVER earlier AS uninterruptible_ns,
        count(*) FILTER (WHERE state = 'preempted') OVER earlier AS preemption_count,
        count(*) FILTER (WHERE is_migration) OVER earlier AS migration_count,
        count(*) FILTER (WHERE is_loss_affected) OVER earlier AS loss_count
    FROM state
    WINDOW earlier AS (PARTITION BY thread_id ORDER BY start_ns ROWS UNBOUNDED PRECEDING)
),
instance AS (
    SELECT callback_instance_id, thread_id, start_ns, end_ns
    FROM staging.callback_instance
    WHERE end_ns IS NOT NULL AND thread_id IN (SELECT thread_id FROM staging.thread_state)
),
edge AS (
    SELECT callback_instance_id, thread_id, start_ns AS at_ns, -1 AS sign FROM instance
    UNION ALL
    SELECT callback_instance_id, thread_id, end_ns, 1 FROM instance
),
-- What is left of the state in which the edge lies does not count yet.
value AS (
    SELECT
        e.callback_instance_id,
        e.sign,
        t.state,
        greatest(t.end_ns - e.at_ns, 0) AS rest_ns,
        coalesce(t.running_ns, 0) AS running_ns,
        coalesce(t.preempted_ns, 0) AS preempted_ns,
        coalesce(t.runnable_ns, 0) AS runnable_ns,
        coalesce(t.sleeping_ns, 0) AS sleeping_ns,
        coalesce(t.uninterruptible_ns, 0) AS uninterruptible_ns,
        coalesce(t.preemption_count, 0) AS preemption_count,
        coalesce(t.migration_count, 0) AS migration_count,
        coalesce(t.loss_count, 0)
        - CASE WHEN e.sign < 0 AND t.is_loss_affected AND t.end_ns > e.at_ns THEN 1 ELSE 0 END
            AS loss_count
    FROM edge AS e
    ASOF LEFT JOIN total AS t ON e.thread_id = t.thread_id AND e.at_ns >= t.start_ns
),
part AS (
    SELECT
        callback_instance_id,
        sum(sign * (running_ns - CASE state WHEN 'running' THEN rest_ns ELSE 0 END))::BIGINT
            AS running_ns,
        sum(sign * (preempted_ns - CASE state WHEN 'preempted' THEN rest_ns ELSE 0 END))::BIGINT
            AS preempted_ns,
        sum(sign * (runnable_ns - CASE state WHEN 'runnable' THEN rest_ns ELSE 0 END))::BIGINT
            AS runnable_ns,
        sum(sign * (sleeping_ns - CASE state WHEN 'sleeping' THEN rest_ns ELSE 0 END))::BIGINT
            AS sleeping_ns,
        sum(
            sign * (uninterruptible_ns - CASE state WHEN 'uninterruptible' THEN rest_ns ELSE 0 END)
        )::BIGINT AS uninterruptible_ns,
        sum(sign * preemption_count)::BIGINT AS preemption_count,
        sum(sign * migration_count)::BIGINT AS migration_count,
        sum(sign * loss_count) > 0 AS is_loss_affected
    FROM value
    GROUP BY callback_instance_id
)
SELECT
    p.callback_instance_id,
    p.running_ns,
    p.preempted_ns,
    p.runnable_ns,
    p.sleeping_ns,
    p.uninterruptible_ns,
    i.end_ns - i.start_ns - p.running_ns - p.preempted_ns - p.runnable_ns - p.sleeping_ns
    - p.uninterruptible_ns AS unknown_ns,
    p.preemption_count,
    p.migration_count,
    p.is_loss_affected
FROM part AS p
JOIN instance AS i ON p.callback_instance_id = i.callback_instance_id
