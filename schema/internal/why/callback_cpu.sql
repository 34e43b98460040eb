-- title: What the threads of callbacks did while these ran
-- description: Where some take much longer than usual, of these. A kernel trace shows it. Else the
--     clock of the thread shows how long it was on a CPU, and samples what else it did: how often
--     they found it asleep in the callback. It was ready without a CPU for no longer than between
--     those around the callback.
-- grain: one row per node and callback of whose time most is known
-- reads: callback_name, callback_use, thread_wait
-- column: node VARCHAR  Node
-- column: callback VARCHAR  What triggers it
-- column: run_ns BIGINT [ns]  Sum of their durations, as far as it is known what the thread did
-- column: running_ns BIGINT [ns]  Part of it: on a CPU
-- column: waiting_ns BIGINT [ns]  Part of it: ready, and without a CPU; NULL: not known
-- column: sleeping_ns BIGINT [ns]  Part of it: asleep; NULL: not known
-- column: disk_ns BIGINT [ns]  Part of it: waiting for a page or a disk; NULL: not known
WITH instance AS (
    SELECT
        n.node, n.callback, i.callback_instance_id, i.thread_id, i.start_ns, i.end_ns, i.cpu_ns,
        i.end_ns - i.start_ns AS run_ns
    FROM main.callback_instance AS i
    JOIN callback_name AS n ON i.callback_id = n.callback_id
    JOIN callback_use AS u ON n.node = u.node AND n.callback = u.callback
    WHERE list_contains($runs, i.run_id)
        AND i.start_ns >= $start_ns AND i.start_ns < $end_ns
        AND i.end_ns - i.start_ns > u.longer_ns
),
seen AS (
    SELECT
        i.node, i.callback, s.sleeping_ns,
        i.run_ns AS all_ns,
        i.run_ns - coalesce(s.unknown_ns, 0) AS run_ns,
        coalesce(s.running_ns, i.cpu_ns) AS cpu_ns,
        CASE
            WHEN s.callback_instance_id IS NOT NULL THEN s.preempted_ns + s.runnable_ns
            WHEN f.thread_id IS NOT NULL AND l.end_ns >= i.end_ns
                THEN least(i.run_ns - i.cpu_ns, l.before_ns + l.waiting_ns - f.before_ns)
        END AS waiting_ns,
        s.uninterruptible_ns AS disk_ns,
        l.samples - f.samples AS samples,
        l.asleep - f.asleep AS asleep,
        l.disk - f.disk AS disk
    FROM instance AS i
    LEFT JOIN main.callback_schedule AS s ON i.callback_instance_id = s.callback_instance_id
    ASOF LEFT JOIN thread_wait AS f ON i.thread_id = f.thread_id AND i.start_ns >= f.start_ns
    ASOF LEFT JOIN thread_wait AS l ON i.thread_id = l.thread_id AND i.end_ns > l.start_ns
    WHERE coalesce(s.running_ns, i.cpu_ns) IS NOT NULL
),
summed AS (
    SELECT
        node, callback,
        sum(run_ns) FILTER (waiting_ns IS NOT NULL OR is_unsampled)::BIGINT AS run_ns,
        sum(cpu_ns) FILTER (waiting_ns IS NOT NULL OR is_unsampled)::BIGINT AS running_ns,
        sum(waiting_ns)::BIGINT AS waiting_ns,
        sum(sleeping_ns)::BIGINT AS sleeping_ns,
        sum(disk_ns)::BIGINT AS disk_ns,
        coalesce(bool_or(sleeping_ns IS NOT NULL), false) AS is_traced,
        1 - sum(asleep) / nullif(sum(samples), 0) AS ready_share,
        coalesce(sum(disk) / nullif(sum(asleep), 0), 0) AS disk_share
    -- What no samples are around tells nothing of what else a thread did, where others are known.
    FROM (
        SELECT
            *,
            max(waiting_ns) OVER (PARTITION BY node, callback) IS NULL AS is_unsampled
        FROM seen
    )
    GROUP BY node, callback
    HAVING 2 * sum(run_ns) >= sum(all_ns)
),
-- Where no sample fell into a callback, the most holds.
shared AS (
    SELECT
        node, callback, run_ns, running_ns, sleeping_ns, disk_ns, disk_share,
        CASE
            WHEN is_traced OR ready_share IS NULL OR waiting_ns IS NULL THEN waiting_ns
            ELSE least(waiting_ns, greatest(run_ns * ready_share - running_ns, 0))::BIGINT
        END AS waiting_ns
    FROM summed
)
SELECT
    node, callback, run_ns, running_ns, waiting_ns,
    coalesce(sleeping_ns, (run_ns - running_ns - waiting_ns) * (1 - disk_share))::BIGINT
        AS sleeping_ns,
    coalesce(disk_ns, (run_ns - running_ns - waiting_ns) * disk_share)::BIGINT AS disk_ns
FROM shared
