-- description: How a run differs from another one, or from itself at another time, by path, ends of
--     paths, callback or topic: what was measured in each, and the difference with a bootstrap
--     confidence interval. Values that follow each other are alike, so blocks of neighbouring
--     values are resampled (circular block bootstrap). The length of a block is estimated from the
--     values of each run. An interval needs ten blocks in either run, and five independent values
--     beyond a quantile; the maximum has no interval. The same seed gives the same interval. The
--     interval says how surely these two recordings differ. It does not say how much a system
--     differs from itself when it is started again.
-- grain: one row per thing compared and statistic; things that only one run has, too
-- param: what VARCHAR  'paths' (end-to-end latency), 'ends' (the same between two topics, by any
--     path), 'callbacks' (duration) or 'topics' (from publication to take)
-- param: run_a, run_b
-- param: from_topic VARCHAR = NULL  Topics or nodes where paths start: names or globs, separated
--     by commas; NULL: any
-- param: to_topic VARCHAR = NULL  Topics or nodes where paths end, in the same form; NULL: any
-- param: wanted_case VARCHAR = 'first'  Arrivals of paths: 'first' or 'last' of each root, 'newest'
--     root of each arrival, or 'every_pair'
-- param: skip_ns BIGINT = 0  Time left out at the start of each run, or of its window
-- param: a_window BIGINT[] = NULL  Begin and end of a time window of run A, epoch ns; NULL: all of
--     it
-- param: b_window
-- param: confidence DOUBLE = 0.95  Share of intervals that would contain the true difference
-- param: at_least DOUBLE = 0.05  Smallest difference that counts as one, as a share of A
-- param: resamples BIGINT = 1000  Number of resamples for the interval
-- param: seed
-- param: internal BOOLEAN = false  Include what ROS does for itself
-- param: max_depth, max_paths
-- column: statistic
-- column: a_ns BIGINT [ns]  Its value in run A
-- column: b_ns BIGINT [ns]  Its value in run B
-- column: difference_ns, change_percent, low_ns, high_ns
-- column: verdict VARCHAR  'B is longer' or 'B is shorter', of these two recordings, where both
--     ends have one sign; 'about equal' where they have, and the difference is less than at_least;
--     'no difference shown', 'too few values' or 'too few independent values'
--     for an interval, 'too few resamples', 'not estimated' (maximum), 'only in A' or 'only in B'
-- column: a_count, b_count
-- column: a_independent BIGINT  How many independent values the values of run A are worth for this
--     statistic: their number divided by how many in a row are alike; NULL if that cannot be
--     estimated, since they are alike for too long
-- column: b_independent BIGINT  The same for run B
-- column: a_share DOUBLE  Share in run A of roots that reached the end, of callback instances that
--     have an end, or of takes whose publication is known
-- column: b_share DOUBLE  The same for run B
-- column: a_loss_affected BIGINT  How many of those roots, callback instances or takes have a gap
--     in their time, so that their values may be wrong
-- column: b_loss_affected BIGINT  The same for run B
-- column: a_ambiguous BIGINT  How many values of run A are of flows or messages with a link that
--     may be another one (a candidate_count above 1)
-- column: b_ambiguous BIGINT  The same for run B
-- column: a_warm_up_ns BIGINT [ns]  Time from the start of run A to the last of its longest values,
--     if at least three of its first quarter exceed all later ones, as in a system that warms up;
--     else NULL
-- column: b_warm_up_ns BIGINT [ns]  The same for run B
-- column: is_cut BOOLEAN  Paths were left out beyond max_depth or max_paths
-- column: subject VARCHAR  Path, its two topics and the node that it ends at, callback, or topic
--     and receiving node
CREATE OR REPLACE MACRO main.comparison(
    what, run_a, run_b, from_topic := NULL, to_topic := NULL, wanted_case := 'first',
    skip_ns := 0, a_window := NULL, b_window := NULL, confidence := 0.95, at_least := 0.05,
    resamples := 1000, seed := 0, internal := false, max_depth := 32, max_paths := 1000
) AS TABLE
WITH path_chain AS MATERIALIZED (
    FROM main.flow_chain(
        [run_a, run_b], from_topic, to_topic, max_depth := max_depth, max_paths := max_paths
    )
),
named_path AS MATERIALIZED (
    SELECT path_id, alike_id, path, is_cut, topics
    FROM main.flow_path([run_a, run_b], chains := 'path_chain')
    WHERE is_path
),
flow AS (
    SELECT
        e.*, p.path, p.is_cut,
        p.topics[1] AS first_topic,
        p.topics[-1] AS last_topic
    FROM main.end_to_end(
        [run_a, run_b], from_topic, to_topic, 'callback_start', 'callback_end',
        (-9223372036854775808)::BIGINT, 9223372036854775807, chains := 'path_chain',
        paths := 'named_path'
    ) AS e
    JOIN named_path AS p ON e.path_id = p.path_id
    WHERE what IN ('paths', 'ends')
),
outcome AS (
    SELECT
        *,
        path AS subject
    FROM flow
    WHERE what IS NOT DISTINCT FROM 'paths'
    UNION ALL BY NAME
    SELECT
        *,
        concat_ws(' → ', coalesce(first_topic, '?'), coalesce(last_topic, '?'), node) AS subject,
        (SELECT bool_or(is_cut) FROM flow) AS is_cut
    FROM main.end_to_end_between('flow')
    WHERE what IS NOT DISTINCT FROM 'ends'
),
thing AS (
    -- A root counts once, however often it arrived; not those that could not arrive, or were cut.
    SELECT
        run_id, subject,
        false AS is_internal,
        root_ns AS at_ns,
        root_id AS id,
        CASE
            WHEN status <> 'reached' THEN NULL
            WHEN wanted_case = 'first' AND NOT is_first THEN NULL
            WHEN wanted_case = 'last' AND NOT is_last THEN NULL
            WHEN wanted_case = 'newest' AND NOT is_newest THEN NULL
            ELSE latency_ns
        END AS value_ns,
        is_first IS NOT false AND status NOT IN ('not_connected', 'cut_by_recording') AS is_unit,
        status = 'reached' AS is_complete,
        is_loss_affected, is_ambiguous, is_cut
    FROM outcome
    UNION ALL
    SELECT
        i.run_id,
        l.node || ' · ' || l.label,
        l.is_internal, i.start_ns, i.callback_instance_id,
        i.end_ns - i.start_ns,
        true,
        i.end_ns IS NOT NULL,
        i.is_loss_affected, false, false
    FROM main.callback_instance AS i
    JOIN main.callback_label AS l ON i.callback_id = l.callback_id
    WHERE what IS NOT DISTINCT FROM 'callbacks' AND list_contains([run_a, run_b], i.run_id)
    UNION ALL
    SELECT
        t.run_id,
        coalesce(s.topic_name, '?') || ' → ' || main.node_label(n.full_name, p.name, p.pid),
        coalesce(s.is_internal, false),
        t.taken_ns, t.take_id, l.latency_ns, true,
        l.take_id IS NOT NULL,
        t.is_loss_affected OR coalesce(l.is_loss_affected, false),
        l.candidate_count > 1,
        false
    FROM main.take AS t
    LEFT JOIN main.link_transport AS l ON t.take_id = l.take_id
    LEFT JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
    LEFT JOIN main.process AS p ON s.process_id = p.process_id
    LEFT JOIN main.node AS n ON s.node_id = n.node_id
    WHERE what IS NOT DISTINCT FROM 'topics'
        AND list_contains([run_a, run_b], t.run_id)
        AND t.method <> 'callback_only'
),
side AS (
    SELECT
        s.side, s.run_id,
        greatest(s.time_window[1], r.start_ns) + skip_ns AS start_ns,
        coalesce(s.time_window[2], 9223372036854775807) AS end_ns
    FROM (VALUES ('a', run_a, a_window), ('b', run_b, b_window)) AS s (side, run_id, time_window)
    JOIN main.run AS r ON s.run_id = r.run_id
    WHERE derive.known_word('what', what, ['paths', 'ends', 'callbacks', 'topics'])
        AND derive.known_word('wanted_case', wanted_case, ['first', 'last', 'newest', 'every_pair'])
),
sided AS MATERIALIZED (
    SELECT s.side, t.*
    FROM thing AS t
    JOIN side AS s ON t.run_id = s.run_id
    WHERE t.at_ns >= s.start_ns AND t.at_ns < s.end_ns AND (internal OR NOT t.is_internal)
),
measured AS MATERIALIZED (
    SELECT
        side, subject,
        count(value_ns) AS number,
        quantile_disc(value_ns, [0.5, 0.95, 0.99]) AS quantiles,
        avg(value_ns) AS mean_ns,
        max(value_ns) AS max_ns,
        list(value_ns ORDER BY at_ns, id, value_ns) FILTER (WHERE value_ns IS NOT NULL)
            AS series,
        count(*) FILTER (WHERE is_unit AND is_complete) / nullif(count(*) FILTER (WHERE is_unit), 0)
            AS share,
        count(*) FILTER (WHERE is_unit AND is_loss_affected) AS loss_affected,
        count(value_ns) FILTER (WHERE is_ambiguous) AS ambiguous,
        bool_or(is_cut) AS is_cut
    FROM sided
    GROUP BY side, subject
),
-- What each statistic varies with, about its mean: the value, or whether it lies beyond a quantile.
centred AS MATERIALIZED (
    SELECT
        s.side, s.subject, m.number,
        row_number() OVER (
            PARTITION BY s.side, s.subject ORDER BY s.at_ns, s.id, s.value_ns
        ) - 1 AS position,
        s.at_ns, s.value_ns,
        s.value_ns - m.mean_ns AS mean_part,
        (s.value_ns > m.quantiles[1])::BIGINT AS median_part,
        (s.value_ns > m.quantiles[2])::BIGINT AS p95_part,
        (s.value_ns > m.quantiles[3])::BIGINT AS p99_part
    FROM sided AS s
    JOIN measured AS m ON s.side = m.side AND s.subject = m.subject
    WHERE s.value_ns IS NOT NULL AND m.number >= 20
),
warm_up AS (
    SELECT
        w.side, w.subject,
        w.last_ns - s.start_ns + skip_ns AS warm_up_ns
    FROM derive.warm_up('centred') AS w
    JOIN side AS s ON w.side = s.side
),
block AS (FROM derive.block_length('centred')),
spread AS (FROM derive.bootstrap_interval('measured', 'block', resamples, confidence, seed)),
value AS (
    SELECT
        m.side, m.subject, m.number, m.share, m.loss_affected, m.ambiguous, w.warm_up_ns, m.is_cut,
        unnest(['median', 'mean', 'p95', 'p99', 'max']) AS statistic,
        unnest([0.5, NULL, 0.95, 0.99, 1.0]) AS quantile,
        unnest([
            m.quantiles[1], round(m.mean_ns)::BIGINT, m.quantiles[2], m.quantiles[3], m.max_ns
        ]) AS value_ns,
        m.number / unnest(list_append(k.times, NULL)) AS independent
    FROM measured AS m
    LEFT JOIN block AS k ON m.side = k.side AND m.subject = k.subject
    LEFT JOIN warm_up AS w ON m.side = w.side AND m.subject = w.subject
),
paired AS (
    SELECT
        coalesce(a.subject, b.subject) AS subject,
        coalesce(a.statistic, b.statistic) AS statistic,
        coalesce(a.quantile, b.quantile) AS quantile,
        a.value_ns AS a_ns,
        b.value_ns AS b_ns,
        coalesce(a.number, 0) AS a_count,
        coalesce(b.number, 0) AS b_count,
        a.independent AS a_independent,
        b.independent AS b_independent,
        a.share AS a_share,
        b.share AS b_share,
        a.loss_affected AS a_loss_affected,
        b.loss_affected AS b_loss_affected,
        a.ambiguous AS a_ambiguous,
        b.ambiguous AS b_ambiguous,
        a.warm_up_ns AS a_warm_up_ns,
        b.warm_up_ns AS b_warm_up_ns,
        coalesce(a.is_cut, false) OR coalesce(b.is_cut, false) AS is_cut
    FROM (FROM value WHERE side = 'a') AS a
    FULL JOIN (FROM value WHERE side = 'b') AS b
        ON a.subject = b.subject AND a.statistic = b.statistic
),
judged AS (
    SELECT
        p.*,
        CASE
            WHEN p.a_count = 0 AND p.b_count = 0 THEN 'too few values'
            WHEN p.b_count = 0 THEN 'only in A'
            WHEN p.a_count = 0 THEN 'only in B'
            WHEN p.quantile = 1 THEN 'not estimated'
            WHEN least(p.a_count, p.b_count) < 20
                OR least(p.a_count, p.b_count) * (1 - coalesce(p.quantile, 0.5)) < 5 - 1e-9
                THEN 'too few values'
            WHEN p.a_independent IS NULL OR p.b_independent IS NULL
                OR least(p.a_independent, p.b_independent) * (1 - coalesce(p.quantile, 0.5))
                    < 5 - 1e-9
                THEN 'too few independent values'
            WHEN s.ends IS NULL THEN 'too few resamples'
        END AS reason,
        p.b_ns - p.a_ns + round(s.ends[1])::BIGINT AS low_ns,
        p.b_ns - p.a_ns + round(s.ends[2])::BIGINT AS high_ns
    FROM paired AS p
    LEFT JOIN spread AS s ON p.subject = s.subject AND p.statistic = s.statistic
)
SELECT
    statistic, a_ns, b_ns,
    b_ns - a_ns AS difference_ns,
    CASE WHEN a_ns > 0 THEN round(100.0 * (b_ns - a_ns) / a_ns, 3) END AS change_percent,
    CASE WHEN reason IS NULL THEN low_ns END AS low_ns,
    CASE WHEN reason IS NULL THEN high_ns END AS high_ns,
    CASE
        WHEN reason IS NOT NULL THEN reason
        WHEN 0 BETWEEN low_ns AND high_ns THEN 'no difference shown'
        WHEN abs(b_ns - a_ns) < at_least * abs(a_ns) THEN 'about equal'
        WHEN low_ns > 0 THEN 'B is longer'
        ELSE 'B is shorter'
    END AS verdict,
    a_count, b_count,
    floor(a_independent + 1e-9)::BIGINT AS a_independent,
    floor(b_independent + 1e-9)::BIGINT AS b_independent,
    round(a_share, 4) AS a_share,
    round(b_share, 4) AS b_share,
    a_loss_affected, b_loss_affected, a_ambiguous, b_ambiguous, a_warm_up_ns, b_warm_up_ns, is_cut,
    subject
FROM judged
ORDER BY
    subject, list_position(['median', 'mean', 'p95', 'p99', 'max'], statistic)
