-- title: What makes data sooner, the best first
-- description: Changes that a replay tried and that gain something on the paths that were asked
--     for, by their mean gain. What only bounds a gain comes last.
-- grain: one row per change
-- reads: candidate, prediction
-- param: paths VARCHAR[]  The paths that were asked for
-- column: rank BIGINT  Place, from 1
-- column: remedy VARCHAR  What it is
-- column: change VARCHAR  What is changed, as `msgflow predict --set` reads it
-- column: node VARCHAR [node]  Node
-- column: callback VARCHAR  What triggers its callback; NULL: all of the node
-- column: function VARCHAR  Its function; NULL: not known
-- column: topic_name VARCHAR [topic]  Topic whose messages it is about; NULL: none
-- column: paths BIGINT  Paths that were asked for on which data come sooner
-- column: of_paths BIGINT  Paths that were asked for and that have a size
-- column: gain_ns BIGINT [ns]  By how much the median is shorter, on average of `paths`
-- column: low_ns BIGINT [ns]  Low end of its interval of 90 %
-- column: high_ns BIGINT [ns]  High end
-- column: p95_gain_ns BIGINT [ns]  By how much their 95th percentile is shorter
-- column: p95_low_ns BIGINT [ns]  Low end of its interval
-- column: p95_high_ns BIGINT [ns]  High end
-- column: share DOUBLE [share]  The larger of both gains as a share of the latency, of `of_paths`
-- column: is_bound BOOLEAN  It gains so much at most
-- column: headline VARCHAR  What to change, and what it gains
-- column: worse VARCHAR[]  What gets worse
-- column: unknown VARCHAR[]  What the recording cannot know of it
-- brief: rank, headline, gain_ns, p95_gain_ns, paths, of_paths, worse, unknown
WITH judged AS (
    SELECT
        *,
        list_contains($paths, path) AS is_asked,
        -- As near as a replay without a change has to be.
        (low_ns > 0 AND gain_ns >= greatest(0.02 * recorded_ns, 100_000))
        OR (
            p95_low_ns > 0 AND p95_gain_ns >= greatest(0.05 * recorded_p95_ns, 100_000)
        ) AS is_better,
        high_ns < 0 AND -gain_ns >= greatest(0.02 * recorded_ns, 100_000) AS is_slower,
        p95_high_ns < 0
        AND -p95_gain_ns >= greatest(0.05 * recorded_p95_ns, 100_000) AS is_often_slower,
        predicted_flows < 0.95 * flows AS is_rarer
    FROM prediction
    WHERE doubt IS NULL
),
summed AS (
    SELECT
        change,
        count(*) FILTER (is_asked AND is_better) AS paths,
        count(*) FILTER (is_asked) AS of_paths,
        avg(gain_ns) FILTER (is_asked AND is_better)::BIGINT AS gain_ns,
        avg(low_ns) FILTER (is_asked AND is_better)::BIGINT AS low_ns,
        avg(high_ns) FILTER (is_asked AND is_better)::BIGINT AS high_ns,
        avg(p95_gain_ns) FILTER (is_asked AND is_better)::BIGINT AS p95_gain_ns,
        avg(p95_low_ns) FILTER (is_asked AND is_better)::BIGINT AS p95_low_ns,
        avg(p95_high_ns) FILTER (is_asked AND is_better)::BIGINT AS p95_high_ns,
        sum(gain_ns + p95_gain_ns) FILTER (is_asked) AS total_ns,
        greatest(
            sum(gain_ns) FILTER (is_asked) / nullif(sum(recorded_ns) FILTER (is_asked), 0),
            sum(p95_gain_ns) FILTER (is_asked) / nullif(sum(recorded_p95_ns) FILTER (is_asked), 0)
        ) AS share,
        count(*) FILTER (is_slower OR is_often_slower) AS worse_paths,
        arg_max(path, greatest(-gain_ns, -p95_gain_ns)) FILTER (is_slower OR is_often_slower)
            AS worst_path,
        max(greatest(-gain_ns, -p95_gain_ns)) FILTER (is_slower OR is_often_slower) AS worst_ns,
        count(*) FILTER (is_rarer) AS rarer_paths,
        max(1 - predicted_flows / flows) FILTER (is_rarer) AS rarer
    FROM judged
    GROUP BY change
    HAVING paths > 0 AND total_ns > 0
),
-- Of several with the same effect, the one of a whole node is made most easily.
simplest AS (
    SELECT s.*, c.remedy, c.node, c.callback, c.function, c.topic_name, c.is_python, c.blamed_ns
    FROM summed AS s
    JOIN candidate AS c ON s.change = c.change
    QUALIFY row_number() OVER (
        PARTITION BY c.remedy, s.gain_ns, s.p95_gain_ns
        ORDER BY c.callback IS NOT NULL, c.blamed_ns DESC, s.change
    ) = 1
),
named AS (
    SELECT
        *,
        printf(
            CASE WHEN callback IS NULL THEN '%2$s' ELSE '%1$s of %2$s' END,
            coalesce(function, callback, ''), node
        ) AS place,
        regexp_extract(change, '[=*]([^=*]*)$', 1) AS value,
        remedy = 'own_cpu' AS is_bound
    FROM simplest
    -- Of one kind the best say enough.
    QUALIFY row_number() OVER (
        PARTITION BY remedy ORDER BY total_ns DESC, blamed_ns DESC, change
    ) <= 3
)
SELECT
    row_number() OVER (
        ORDER BY is_bound, total_ns DESC, blamed_ns DESC, change
    ) AS rank,
    remedy, change, node, callback, function, topic_name, paths, of_paths, gain_ns, low_ns,
    high_ns, p95_gain_ns, p95_low_ns, p95_high_ns, share, is_bound,
    printf(
        '%s: %s %s on %d of %d path%s',
        CASE remedy
            WHEN 'own_executor' THEN 'own executor for ' || place
            WHEN 'more_threads' THEN printf('%s threads for the executor of %s', value, node)
            WHEN 'faster' THEN '30 % less time in ' || place
            WHEN 'newest_only' THEN printf('a queue of 1 for %s at %s', topic_name, node)
            WHEN 'shorter_period' THEN printf('%s every %s', place, value)
            WHEN 'phase' THEN printf('%s due %s later', place, value)
            WHEN 'react' THEN printf('%s reacts to %s in place of its timer', place, topic_name)
            WHEN 'one_process'
                THEN printf('%s and the publisher of %s in one process', node, topic_name)
            WHEN 'await' THEN printf('await %s in %s', coalesce(topic_name, 'the call'), place)
            WHEN 'lock' THEN 'a lock that is free for ' || place
            WHEN 'sleep' THEN 'no sleep in ' || place
            WHEN 'own_cpu' THEN 'a CPU of its own for ' || place
        END,
        CASE WHEN is_bound THEN 'at most' ELSE 'about' END,
        CASE
            WHEN p95_low_ns > 0 AND p95_gain_ns > gain_ns
                THEN printf('%s (p95)', main.duration_text(-p95_gain_ns))
            ELSE main.duration_text(-gain_ns)
        END,
        paths, of_paths,
        CASE WHEN of_paths = 1 THEN '' ELSE 's' END
    ) AS headline,
    list_filter(
        [
            printf(
                '%s by up to %s%s', worst_path, main.duration_text(worst_ns),
                CASE WHEN worse_paths > 1
                    THEN printf(', and %d more', worse_paths - 1) ELSE '' END
            ),
            CASE WHEN rarer_paths > 0 THEN printf(
                'up to %.0f %% less arrives on %d path%s', 100 * rarer, rarer_paths,
                CASE WHEN rarer_paths > 1 THEN 's' ELSE '' END
            ) END,
            CASE
                WHEN remedy IN ('own_executor', 'more_threads') THEN 'one more thread'
                WHEN remedy = 'shorter_period' THEN 'twice as many calls'
            END
        ],
        lambda line: line IS NOT NULL
    ) AS worse,
    list_filter(
        [
            CASE
                WHEN remedy IN ('own_executor', 'more_threads')
                    THEN 'whether what then runs at the same time shares data, and has a CPU'
                WHEN remedy = 'faster' THEN 'how it can be faster'
                WHEN remedy = 'newest_only' THEN 'whether anything needs each message'
                WHEN remedy IN ('shorter_period', 'react')
                    THEN 'whether what uses its messages takes them so often'
                WHEN remedy = 'phase' THEN 'whether both timers begin at the same time again'
                WHEN remedy = 'one_process'
                    THEN 'messages without a copy may travel shorter still'
                WHEN remedy = 'await' THEN 'how much of its work follows the answer'
                WHEN remedy IN ('lock', 'sleep') THEN 'whether it can do without'
                WHEN remedy = 'own_cpu' THEN 'whether a CPU is free'
            END,
            CASE WHEN remedy IN ('own_executor', 'more_threads') AND is_python
                THEN 'Python computes in one thread of a process at a time' END
        ],
        lambda line: line IS NOT NULL
    ) AS unknown
FROM named
ORDER BY rank
