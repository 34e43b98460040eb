-- title: Loops that publish without an executor
-- description: Threads that publish outside of callbacks, over and over, such as control loops, and
--     loops with a Rate or spin_once. A round is from one message of the topic that a thread
--     publishes most on to the next. It is overrun if it takes a fifth longer than most rounds.
--     What ran meanwhile are callbacks of the same process, on whatever thread: they may hold a
--     lock, the interpreter, or the thread itself; and with a kernel trace what had the CPU for
--     which the thread waited. Rounds with a gap of the trace are left out, and so are threads that
--     messages drive: they take one before most of what they publish.
-- grain: one row per thread
-- column: run_id
-- column: node VARCHAR [node]       Node that publishes
-- column: topic_name VARCHAR [topic]  Topic that it publishes most on
-- column: thread VARCHAR            Name and id of the thread
-- column: rounds BIGINT             Rounds in the time window
-- column: target_ns BIGINT [ns]     How long most rounds take, to 1 %
-- column: rate_hz DOUBLE [Hz]       Rounds per second
-- column: overruns BIGINT           Rounds that took a fifth longer, or more
-- column: longest_ns BIGINT [ns]    The longest round
-- column: longest_at_ns BIGINT [epoch ns]  When that began
-- column: work_median_ns BIGINT [ns]  Median time from the first message of a round to the end of
--     its last
-- column: work_max_ns BIGINT [ns]   Longest time of that
-- column: meanwhile VARCHAR         What ran during overruns: the three with the largest share of
--     their time
-- column: thread_id
-- brief: node, topic_name, target_ns, overruns, longest_ns, meanwhile, rounds, rate_hz, thread,
--     work_max_ns
-- note: callbacks
CREATE OR REPLACE TEMP TABLE loop_round AS
WITH run AS (
    SELECT thread_id, start_ns, end_ns
    FROM main.callback_instance
    WHERE list_contains($runs, run_id)
),
-- Where no callback is traced, each message seems to come from outside of one.
traced AS (
    SELECT process_id
    FROM main.process AS p
    WHERE list_contains($runs, p.run_id) AND (
        p.process_id IN (
            SELECT process_id FROM main.callback_instance WHERE list_contains($runs, run_id)
        )
        OR NOT EXISTS (
            FROM main.timer AS t WHERE t.process_id = p.process_id AND t.node_id IS NOT NULL
        )
    )
),
published AS (
    SELECT
        b.run_id, b.thread_id, b.publisher_id, b.start_ns, b.end_ns, b.is_loss_affected,
        b.publication_id IN (
            SELECT publication_id
            FROM main.link_causal
            WHERE list_contains($runs, run_id) AND kind IN ('take_adjacent', 'queue')
                AND candidate_count = 1
        ) AS is_driven
    FROM main.publication AS b
    JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
    ASOF LEFT JOIN run AS r ON b.thread_id = r.thread_id AND b.start_ns >= r.start_ns
    WHERE list_contains($runs, b.run_id) AND NOT p.is_internal
        AND b.start_ns >= $start_ns AND b.start_ns < $end_ns
        AND b.process_id IN (FROM traced)
        -- A callback that has no end goes on.
        AND (r.thread_id IS NULL OR r.end_ns < b.start_ns)
),
marked AS (
    SELECT
        *,
        publisher_id = mode(publisher_id) OVER (PARTITION BY thread_id) AS is_round
    FROM published
    QUALIFY avg(is_driven::INTEGER) OVER (PARTITION BY thread_id) <= 0.5
),
numbered AS (
    SELECT
        *,
        count(*) FILTER (is_round) OVER (PARTITION BY thread_id ORDER BY start_ns) AS number
    FROM marked
)
SELECT
    any_value(run_id) AS run_id,
    thread_id, number,
    min(publisher_id) FILTER (is_round) AS publisher_id,
    min(start_ns) AS start_ns,
    lead(min(start_ns)) OVER (PARTITION BY thread_id ORDER BY number) AS next_ns,
    max(coalesce(end_ns, start_ns)) AS worked_until_ns,
    bool_or(is_loss_affected)
        OR lead(bool_or(is_loss_affected)) OVER (PARTITION BY thread_id ORDER BY number)
        AS is_loss_affected
FROM numbered
WHERE number > 0
GROUP BY thread_id, number
QUALIFY count(*) OVER (PARTITION BY thread_id) >= 10;

CREATE OR REPLACE TEMP TABLE loop_measured AS
WITH usual AS (
    SELECT
        thread_id,
        quantile_disc(next_ns - start_ns, 0.5) AS median_ns
    FROM loop_round
    WHERE NOT is_loss_affected
    GROUP BY thread_id
),
target AS (
    SELECT
        r.thread_id,
        arg_max(quantile_disc(r.next_ns - r.start_ns, 0.5), count(*))
            OVER (PARTITION BY r.thread_id) AS target_ns
    FROM loop_round AS r
    JOIN usual AS u ON r.thread_id = u.thread_id
    WHERE NOT r.is_loss_affected
    GROUP BY r.thread_id, round(100 * (r.next_ns - r.start_ns) / u.median_ns)
)
SELECT
    r.*,
    t.target_ns,
    r.next_ns - r.start_ns > 1.2 * t.target_ns AS is_overrun
FROM loop_round AS r
JOIN (SELECT DISTINCT thread_id, target_ns FROM target) AS t ON r.thread_id = t.thread_id
WHERE NOT r.is_loss_affected AND r.next_ns IS NOT NULL;

WITH overrun AS (
    SELECT
        r.thread_id AS id,
        h.process_id, r.start_ns,
        r.next_ns AS end_ns
    FROM loop_measured AS r
    JOIN main.thread AS h ON r.thread_id = h.thread_id
    WHERE r.is_overrun
),
-- Callbacks, and what had the CPU for which the thread waited.
beside AS (
    SELECT
        b.id,
        l.node || ' ' || l.label AS what,
        b.share
    FROM main.callback_beside('overrun') AS b
    JOIN main.callback_label AS l ON b.alike_id = l.callback_id
    UNION ALL
    SELECT
        o.id,
        coalesce(x.program, h.name, 'nothing') || ' on its CPU',
        sum(least(p.end_ns, o.end_ns) - greatest(p.start_ns, o.start_ns)) / any_value(o.total_ns)
    FROM (
        SELECT
            *,
            sum(end_ns - start_ns) OVER (PARTITION BY id) AS total_ns
        FROM overrun
    ) AS o
    JOIN main.preemptor AS p
        ON o.id = p.thread_id AND p.start_ns < o.end_ns AND p.end_ns > o.start_ns
    LEFT JOIN main.other_thread AS x ON p.preemptor_other_thread_id = x.other_thread_id
    LEFT JOIN main.thread AS h ON p.preemptor_thread_id = h.thread_id
    WHERE $has_kernel
    GROUP BY o.id, coalesce(x.program, h.name, 'nothing')
),
meanwhile AS (
    SELECT
        id AS thread_id,
        string_agg(printf('%s %.0f %%', what, 100 * share), ', ' ORDER BY share DESC, what)
            AS shares
    FROM (
        FROM beside
        WHERE share >= 0.1
        QUALIFY row_number() OVER (PARTITION BY id ORDER BY share DESC, what) <= 3
    )
    GROUP BY id
),
measured AS (
    SELECT
        run_id, thread_id,
        any_value(publisher_id) AS publisher_id,
        any_value(target_ns) AS target_ns,
        count(*) AS rounds,
        count(*) * 1e9 / sum(next_ns - start_ns) AS rate_hz,
        count(*) FILTER (is_overrun) AS overruns,
        max(next_ns - start_ns) AS longest_ns,
        arg_max(start_ns, next_ns - start_ns) AS longest_at_ns,
        quantile_disc(worked_until_ns - start_ns, [0.5, 1]) AS work
    FROM loop_measured
    GROUP BY run_id, thread_id
)
SELECT
    m.run_id,
    main.node_label(n.full_name, p.name, p.pid) AS node,
    b.topic_name,
    printf('%s %d', coalesce(h.name, p.name, '?'), h.tid) AS thread,
    m.rounds, m.target_ns, m.rate_hz, m.overruns, m.longest_ns, m.longest_at_ns,
    m.work[1] AS work_median_ns,
    m.work[2] AS work_max_ns,
    w.shares AS meanwhile,
    m.thread_id
FROM measured AS m
JOIN main.publisher AS b ON m.publisher_id = b.publisher_id
JOIN main.thread AS h ON m.thread_id = h.thread_id
JOIN main.process AS p ON h.process_id = p.process_id
LEFT JOIN main.node AS n ON b.node_id = n.node_id
LEFT JOIN meanwhile AS w ON m.thread_id = w.thread_id
ORDER BY m.run_id, node, b.topic_name, m.thread_id
