-- title: What changed during a run, and when
-- description: Latency of paths, durations and CPU times of callbacks, periods of timers and
--     topics, waits, queues and losses of messages, CPU use of programs: steps from one level to
--     another, trends, pauses, bursts, and what stops or begins. Each with what else changed or
--     began within the same second. The time until the nodes have started is left out, and so are
--     the windows at both ends: 1 of 16 of the run.
-- grain: one row per change
-- reads: path_outcome, named_path
-- param: from, to, from_event, to_event, max_depth, max_paths
-- column: run_id
-- column: at_ns BIGINT [epoch ns]  When; of a trend its begin
-- column: kind VARCHAR              'step', 'trend', 'stop' (silent until the end), 'begin' (silent
--     before), 'gap' (silent for much longer than usual, the first of several) or 'burst' (far more
--     than usual, likewise)
-- column: what VARCHAR              What changed: 'latency' of a path, 'duration' or 'CPU time' of
--     a callback, the period of a 'timer' or 'topic', or of the 'take' of a subscription, 'wait' of
--     messages, the 'queue' in which they wait, their 'loss', or 'CPU use' of a program
-- column: node VARCHAR [node]       Node; empty: several, on a path
-- column: subject VARCHAR           The path, callback, topic or program
-- column: before DOUBLE             Median before, and the period of what stops: [ns], of 'loss' a
--     share, of 'queue' messages, of 'CPU use' CPUs
-- column: after DOUBLE              Median after; of 'stop', 'begin' and 'gap' the longest silence
-- column: change VARCHAR            Both, as people say it
-- column: sentence VARCHAR          All of it, as people say it; moments since the begin of the run
-- column: count BIGINT              Pauses, or messages and calls that are missing in the silence,
--     or that a burst has more
-- column: certainty DOUBLE [share]  Windows on their side of the middle between before and after;
--     of a trend, by how much more pairs of windows go its way than the other
-- column: low DOUBLE                Trends: with 90 %, the slope is at least so much, per second
-- column: high DOUBLE               Trends: and at most so much
-- column: follows VARCHAR           The change that explains this one; empty: none does
-- column: change_id BIGINT          Its number in the answer
-- column: follows_id BIGINT         Number of the change that explains it
-- column: meanwhile_node VARCHAR [node]  Node of the callback that ran for half of the time of the
--     pauses, or more
-- column: meanwhile_callback VARCHAR  What triggers it
-- column: meanwhile_share DOUBLE [share]  For so much of their time
-- column: since VARCHAR             What began or happened within the same second, and fits best
-- column: others VARCHAR[]          What else did, the nearest in time first
-- brief: at_ns, sentence, kind, what, count, follows, certainty, others, meanwhile_callback, node,
--     subject, change, since, meanwhile_node, meanwhile_share
-- note: callbacks
CREATE OR REPLACE TEMP TABLE series AS
FROM main.series($runs);

CREATE OR REPLACE TEMP TABLE settled AS
FROM main.settled($runs, $start_ns, $end_ns);

CREATE OR REPLACE TEMP TABLE series_value AS
SELECT v.run_id, v.what, v.series_id, v.at_ns, v.value
FROM main.series_value($runs, 'series', 'path_outcome') AS v
JOIN settled AS s ON v.run_id = s.run_id
WHERE v.at_ns >= s.start_ns AND v.at_ns < s.end_ns;

CREATE OR REPLACE TEMP TABLE series_window AS
FROM main.series_window('series_value', 'settled');

CREATE OR REPLACE TEMP TABLE change_step AS
FROM main.value_step('series_window');

-- How many of the windows around the moment are on their side.
CREATE OR REPLACE TEMP TABLE clear_step AS
FROM (
    SELECT
        c.*,
        avg(
            ((w.value > (c.before + c.after) / 2) = ((w.at_ns >= c.at_ns) = (c.after > c.before)))
            ::INTEGER
        ) AS certainty
    FROM main.value_step_exact('change_step', 'series_value', 'settled') AS c
    JOIN settled AS s ON c.run_id = s.run_id
    JOIN series_window AS w
        ON c.what = w.what
        AND c.series_id = w.series_id
        AND abs(w.at_ns - c.at_ns) < (s.end_ns - s.start_ns) // 8
    GROUP BY ALL
)
WHERE certainty > 0.85;

CREATE OR REPLACE TEMP TABLE change_found AS
WITH trend AS (FROM main.value_trend('series_window'))
SELECT
    run_id,
    'trend' AS kind,
    what, series_id, at_ns, before, after, certainty,
    slopes[1] * 1e9 AS low,
    slopes[3] * 1e9 AS high
FROM trend
UNION ALL BY NAME
SELECT
    run_id,
    'step' AS kind,
    what, series_id, at_ns, before, after, certainty
FROM clear_step
ANTI JOIN trend USING (what, series_id)
UNION ALL BY NAME
SELECT
    run_id, kind, what, series_id, at_ns,
    usual AS before,
    longest_ns AS after,
    count, times
FROM main.value_pause('series_value', 'settled')
UNION ALL BY NAME
SELECT
    run_id,
    'burst' AS kind,
    what, series_id, at_ns,
    usual AS before,
    shortest_ns AS after,
    count
FROM main.value_burst('series_value')
UNION ALL BY NAME
SELECT
    run_id,
    'step' AS kind,
    'loss' AS what,
    series_id, at_ns, before, after
FROM main.loss_step('series_value');

-- What each series is of, which topics lead to it, and which are made of it.
CREATE OR REPLACE TEMP TABLE series_named AS
WITH node_topic AS (
    SELECT
        run_id, node,
        list_distinct(list(topic_name) FILTER (owner = 'subscription')) AS takes,
        list_distinct(list(topic_name) FILTER (owner = 'publisher')) AS gives
    FROM series
    GROUP BY run_id, node
)
SELECT
    unnest(
        CASE s.owner
            WHEN 'callback' THEN ['duration', 'CPU time', 'timer']
            WHEN 'publisher' THEN ['topic']
            WHEN 'subscription' THEN ['take', 'wait', 'queue', 'loss']
            ELSE ['CPU use']
        END
    ) AS what,
    s.series_id, s.node, s.subject, s.process_id, s.host_id, s.topic_name,
    [s.node] AS nodes,
    CASE
        WHEN s.owner = 'publisher' THEN n.takes
        WHEN s.topic_name IS NULL THEN []
        ELSE [s.topic_name]
    END AS takes,
    n.gives
FROM series AS s
LEFT JOIN node_topic AS n ON s.run_id = n.run_id AND s.node = n.node
WHERE s.object_id = s.series_id
UNION ALL
SELECT
    'latency', path_id, NULL, path, NULL, NULL, NULL,
    string_split(path, ' → '),
    topics,
    []
FROM named_path;

CREATE OR REPLACE TEMP TABLE change_named AS
SELECT
    row_number() OVER (ORDER BY c.at_ns, c.what, c.series_id) AS change_id,
    c.*,
    s.node, s.subject, s.process_id, s.host_id, s.topic_name, s.nodes, s.takes, s.gives,
    CASE WHEN c.what = 'take' AND c.kind <> 'step' THEN 'taking ' ELSE '' END
    || coalesce(s.subject, '?')
    || coalesce(
        CASE
            WHEN c.what IN ('wait', 'queue', 'loss') THEN ' for '
            WHEN c.what = 'take' THEN ' by '
            ELSE ' of '
        END
        || s.node,
        ''
    ) AS whose
FROM change_found AS c
LEFT JOIN series_named AS s ON c.what = s.what AND c.series_id = s.series_id;

CREATE OR REPLACE TEMP TABLE change_occasion AS
SELECT
    c.change_id, o.sentence,
    abs(o.at_ns - c.at_ns) AS apart_ns,
    o.kind = 'program' AS is_load,
    CASE
        WHEN list_has_any(o.nodes, c.nodes) THEN 1
        WHEN list_has_any(o.topics, list_concat(c.takes, c.gives)) THEN 2
        WHEN len(o.nodes) = 0 AND (o.host_id IS NULL OR o.host_id = c.host_id) THEN 3
        ELSE 4
    END AS place
FROM change_named AS c
JOIN main.occasion($runs, 'series') AS o
    ON c.run_id = o.run_id
    AND o.at_ns BETWEEN c.at_ns - 1_000_000_000 AND c.at_ns + 1_000_000_000
WHERE c.kind <> 'trend';

-- A change that explains another one: it comes with it, or before it in the chain.
CREATE OR REPLACE TEMP TABLE change_cause AS
SELECT
    c.change_id,
    arg_min(
        x.change_id,
        (
            CASE
                WHEN l.change_id IS NOT NULL AND x.process_id <> c.process_id THEN 4
                WHEN x.what = 'duration' THEN 0
                WHEN x.what = 'timer' THEN 1
                WHEN x.what = 'topic' THEN 2
                ELSE 3
            END,
            abs(x.at_ns - c.at_ns)
        )
    ) AS cause_id
FROM change_named AS c
JOIN change_named AS x
    ON c.run_id = x.run_id
    AND c.change_id <> x.change_id
    AND (c.kind = 'trend') = (x.kind = 'trend')
-- A program that takes the CPU makes others wait, sooner or later.
LEFT JOIN (SELECT DISTINCT change_id FROM change_occasion WHERE is_load) AS l
    ON x.change_id = l.change_id AND x.what = 'duration' AND x.host_id = c.host_id
-- What ends, or begins, with its node explains nothing else of it.
ANTI JOIN (FROM change_occasion WHERE place = 1) AS e
    ON x.change_id = e.change_id AND x.what = 'take'
WHERE (
        c.kind = 'trend'
        -- A queue of ten messages at 10 Hz needs 10 s to fill if a tenth too many come, and losses
        -- are noticed now and then.
        OR x.at_ns BETWEEN
            c.at_ns - CASE
                WHEN x.what = 'loss' OR l.change_id IS NOT NULL THEN c.at_ns
                WHEN c.what IN ('wait', 'queue', 'latency', 'loss') THEN 10_000_000_000
                ELSE 1_000_000_000
            END
            AND c.at_ns + 1_000_000_000
    )
    AND (
        (l.change_id IS NOT NULL AND c.what IN ('wait', 'queue', 'loss', 'take', 'topic', 'timer'))
        OR CASE c.what
            WHEN 'duration' THEN
                x.what = 'CPU use'
                AND x.host_id = c.host_id
                AND x.process_id IS DISTINCT FROM c.process_id
                AND x.after > x.before
                AND c.after > c.before
            WHEN 'CPU use' THEN
                x.what IN ('duration', 'timer', 'topic', 'take') AND x.process_id = c.process_id
            WHEN 'latency' THEN
                x.what IN ('duration', 'wait', 'timer', 'topic') AND list_contains(c.nodes, x.node)
            WHEN 'CPU time' THEN x.what = 'duration' AND x.series_id = c.series_id
            WHEN 'topic' THEN
                -- What keeps a node from taking for a while keeps it from publishing as well.
                (
                    (x.what IN ('duration', 'timer') OR (x.what = 'take' AND x.kind <> 'gap'))
                    AND x.node = c.node
                )
                OR (x.what IN ('topic', 'loss') AND list_contains(c.takes, x.topic_name))
            WHEN 'timer' THEN x.what = 'duration' AND x.process_id = c.process_id
            -- Of a subscription: 'wait', 'queue', 'take', 'loss'.
            ELSE
                (x.what = 'duration' AND x.process_id = c.process_id)
                OR (x.what = 'topic' AND x.topic_name = c.topic_name)
                OR CASE c.what
                    WHEN 'wait' THEN x.what = 'duration' AND list_contains(x.gives, c.topic_name)
                    WHEN 'queue' THEN x.what = 'wait' AND x.series_id = c.series_id
                    WHEN 'take' THEN x.what = 'loss' AND x.series_id = c.series_id
                END
        END
    )
GROUP BY c.change_id;

-- Where changes explain each other in a circle, the earliest has no cause.
CREATE OR REPLACE TEMP TABLE change_first AS
WITH RECURSIVE behind (change_id, cause_id) AS (
    SELECT change_id, cause_id FROM change_cause
    UNION
    SELECT b.change_id, c.cause_id
    FROM behind AS b
    JOIN change_cause AS c ON b.cause_id = c.change_id
)
SELECT change_id
FROM behind
GROUP BY change_id
HAVING min(cause_id) = change_id;

-- Which callback of the process ran for half of the time of the pauses, or more.
CREATE OR REPLACE TEMP TABLE change_beside AS
WITH pause AS (
    SELECT
        change_id AS id,
        process_id,
        ends[1] AS start_ns,
        ends[2] AS end_ns
    FROM (
        SELECT
            change_id, process_id,
            unnest(times) AS ends
        FROM change_named
        WHERE kind = 'gap'
    )
)
SELECT
    b.id AS change_id,
    l.node,
    l.label AS subject,
    b.share
FROM main.callback_beside('pause') AS b
JOIN main.callback_label AS l ON b.alike_id = l.callback_id
WHERE b.share >= 0.5 AND NOT l.is_internal
QUALIFY row_number() OVER (PARTITION BY b.id ORDER BY b.share DESC, b.alike_id) = 1;

WITH best AS (
    SELECT
        change_id,
        arg_min(sentence, (place, apart_ns)) FILTER (place <= 3) AS since,
        list(sentence ORDER BY apart_ns, sentence) AS sentences
    FROM change_occasion
    GROUP BY change_id
)
SELECT
    c.run_id, c.at_ns, c.kind, c.what, c.node, c.subject, c.before, c.after,
    CASE
        WHEN c.what = 'loss' THEN printf('%.0f → %.0f %%', 100 * c.before, 100 * c.after)
        WHEN c.what = 'queue' THEN printf('%.0f → %.0f messages', c.before, c.after)
        WHEN c.what = 'CPU use' THEN printf('%.2f → %.2f CPUs', c.before, c.after)
        ELSE main.duration_text(c.before::BIGINT) || ' → ' || main.duration_text(c.after::BIGINT)
    END AS change,
    printf(
        '%s %.1f s%s: ',
        CASE
            WHEN c.kind IN ('step', 'stop') THEN 'since'
            WHEN c.kind = 'begin' THEN 'until'
            WHEN c.kind = 'trend' THEN 'steadily from'
            WHEN c.count = 1 THEN 'at'
            ELSE 'from'
        END,
        (c.at_ns - r.start_ns) / 1e9,
        coalesce(', when ' || b.since, '')
    )
        || CASE
            WHEN c.kind IN ('stop', 'begin') THEN
                printf('%s is silent, %d missing', c.whose, c.count)
            WHEN c.kind = 'gap' THEN
                printf(
                    '%d pause%s of %s, %s', c.count, CASE WHEN c.count > 1 THEN 's' ELSE '' END,
                    c.whose, change
                )
                || coalesce(printf(', while %s of %s runs', d.subject, d.node), '')
            WHEN c.kind = 'burst' THEN printf('%d more of %s, %s', c.count, c.whose, change)
            ELSE printf(
                '%s of %s: %s',
                CASE
                    WHEN c.what IN ('timer', 'topic') THEN 'period'
                    WHEN c.what = 'take' THEN 'time between takes'
                    ELSE c.what
                END,
                c.whose, change
            )
        END AS sentence,
    c.count,
    c.certainty, c.low, c.high,
    x.what || ' ' || x.subject || coalesce(' of ' || x.node, '') AS follows,
    c.change_id,
    x.change_id AS follows_id,
    d.node AS meanwhile_node,
    d.subject AS meanwhile_callback,
    d.share AS meanwhile_share,
    b.since,
    list_filter(b.sentences, lambda each: each IS DISTINCT FROM b.since) AS others
FROM change_named AS c
JOIN main.run AS r ON c.run_id = r.run_id
LEFT JOIN (FROM change_cause ANTI JOIN change_first USING (change_id)) AS f
    ON c.change_id = f.change_id
LEFT JOIN change_named AS x ON f.cause_id = x.change_id
LEFT JOIN best AS b ON c.change_id = b.change_id
LEFT JOIN change_beside AS d ON c.change_id = d.change_id
ORDER BY c.run_id, x.change_id IS NOT NULL, c.at_ns, c.what, c.node, c.subject
