-- title: How runs of one side differ from those of another
-- description: Compares two sides by `measured` (rows of `internal.fleet_run_value`). A run, or
--     what it is a sample of, is one value, however many flows it has. The difference
--     between the sides is measured against the differences between runs of a side. Yuen's test
--     compares the sides: trimmed means (without the lowest and the highest fifth of the runs), and
--     Welch's t with winsorized variances. It takes logarithms, so that a difference is a share.
--     Where a value of a path is not positive, it takes the values themselves. All statistics of a
--     path are of the same runs: those with flows enough for a quantile that at least half of the
--     runs of either side allow. So none is below one that it cannot be below.
-- grain: one row per path and statistic; paths that only one side has, too
-- reads: measured
-- param: z DOUBLE  Quantile of the standard normal distribution for the confidence wanted
-- param: at_least DOUBLE  Smallest difference that counts as one, as a share of A
-- param: least_units BIGINT  Fewest runs of either side for an interval
-- column: statistic VARCHAR  'median', 'mean', 'p95', 'p99' or 'max'
-- column: a_ns BIGINT [ns]  Its value in a typical run of side A
-- column: b_ns BIGINT [ns]  Its value in a typical run of side B
-- column: change_percent DOUBLE  Difference in percent of A; NULL where A is not positive
-- column: low_percent DOUBLE  Lower end of the confidence interval of the change
-- column: high_percent DOUBLE  Its upper end
-- column: verdict VARCHAR  'B is longer' or 'B is shorter' where both ends have one sign, or 'about
--     equal' if the difference is less than at_least; else 'no difference shown'; 'too few runs',
--     'too few values' (in too many of the runs) or 'not estimated' (maximum), 'only in A' or 'only
--     in B'
-- column: a_spread_percent DOUBLE  Width of the middle half of the runs of A, in percent
-- column: b_spread_percent DOUBLE  Width of the middle half of the runs of B, in percent
-- column: difference_ns BIGINT [ns]  B less A
-- column: low_ns BIGINT [ns]  Lower end of the confidence interval of the difference
-- column: high_ns BIGINT [ns]  Its upper end
-- column: a_count BIGINT  Runs of A whose values count
-- column: b_count BIGINT  Runs of B whose values count
-- column: a_flows BIGINT  Flows measured in all runs of A
-- column: b_flows BIGINT  Flows measured in all runs of B
-- column: a_share DOUBLE  Share of the roots of all runs of A that reached the end
-- column: b_share DOUBLE  Share of the roots of all runs of B that reached the end
-- column: a_loss_affected BIGINT  Roots of A with a gap of a trace in their time
-- column: b_loss_affected BIGINT  Roots of B with a gap of a trace in their time
-- column: a_ambiguous BIGINT  Flows of A that pass a link that may be another one
-- column: b_ambiguous BIGINT  Flows of B that do
-- column: is_cut BOOLEAN  Paths of a run were left out beyond the limits
-- column: subject VARCHAR  Nodes and topics of the path
WITH of_run AS (
    -- Statistics that a run has flows enough for; who has them for p99 has them for all others.
    SELECT side, subject, unit, run, count(*) FILTER (is_enough) AS depth
    FROM measured
    WHERE value_ns IS NOT NULL
    GROUP BY side, subject, unit, run
),
deepest AS (
    SELECT side, subject, unit, max(depth) AS depth FROM of_run GROUP BY side, subject, unit
),
allowing AS (
    SELECT
        u.side, u.subject, w.depth,
        count(*) FILTER (u.depth >= w.depth) AS units,
        count(*) FILTER (u.depth > 0) AS whole
    FROM deepest AS u
    JOIN (SELECT DISTINCT subject, depth FROM deepest WHERE depth > 0) AS w
        ON u.subject = w.subject
    GROUP BY u.side, u.subject, w.depth
),
wanted AS (
    SELECT subject, max(depth) AS depth
    FROM (
        SELECT subject, depth
        FROM allowing
        GROUP BY subject, depth
        HAVING bool_and(units >= $least_units AND 2 * units >= whole)
    )
    GROUP BY subject
),
-- Short runs count where there are no others, and then there is no interval.
counted AS (
    SELECT r.side, r.subject, r.run
    FROM of_run AS r
    LEFT JOIN wanted AS w ON r.subject = w.subject
    QUALIFY r.depth >= coalesce(
        w.depth, least(1, max(r.depth) OVER (PARTITION BY r.side, r.subject))
    )
),
of_side AS (
    SELECT
        m.side, m.subject, m.statistic,
        sum(m.number)::BIGINT AS flows,
        sum(m.roots) AS roots,
        sum(m.reached) AS reached,
        sum(m.loss_affected)::BIGINT AS loss_affected,
        sum(m.ambiguous)::BIGINT AS ambiguous,
        bool_or(m.is_cut) AS is_cut,
        count(DISTINCT m.unit) FILTER (m.value_ns IS NOT NULL) AS units,
        coalesce(bool_and(m.is_enough) FILTER (c.run IS NOT NULL), false) AS is_enough
    FROM measured AS m
    LEFT JOIN counted AS c ON m.side = c.side AND m.subject = c.subject AND m.run = c.run
    GROUP BY m.side, m.subject, m.statistic
),
unit AS (
    SELECT m.side, m.unit, m.subject, m.statistic, median(m.value_ns) AS value_ns
    FROM measured AS m
    JOIN counted AS c ON m.side = c.side AND m.subject = c.subject AND m.run = c.run
    GROUP BY m.side, m.unit, m.subject, m.statistic
),
scaled AS (SELECT *, min(value_ns) OVER (PARTITION BY subject) > 0 AS is_log FROM unit),
ranked AS (
    SELECT
        side, subject, statistic, is_log,
        CASE WHEN is_log THEN ln(value_ns) ELSE value_ns END AS x,
        row_number() OVER (PARTITION BY side, subject, statistic ORDER BY value_ns, unit) AS nth,
        count(*) OVER (PARTITION BY side, subject, statistic) AS number,
        (number // 5) AS trimmed
    FROM scaled
),
ends AS (
    SELECT
        side, subject, statistic,
        any_value(is_log) AS is_log,
        any_value(number) AS number,
        any_value(number - 2 * trimmed) AS kept,
        avg(x) FILTER (nth > trimmed AND nth <= number - trimmed) AS centre,
        min(x) FILTER (nth > trimmed) AS lowest,
        max(x) FILTER (nth <= number - trimmed) AS highest,
        quantile_cont(x, 0.75) - quantile_cont(x, 0.25) AS spread
    FROM ranked
    GROUP BY side, subject, statistic
),
centre AS (
    SELECT
        e.side, e.subject, e.statistic,
        any_value(e.is_log) AS is_log,
        any_value(e.number) AS number,
        any_value(e.kept) AS kept,
        any_value(e.centre) AS centre,
        any_value(CASE
            WHEN e.is_log THEN 100 * (exp(e.spread) - 1) ELSE 100 * e.spread / abs(e.centre)
        END) AS spread_percent,
        -- How far the trimmed mean may be off, squared.
        var_samp(greatest(e.lowest, least(e.highest, r.x))) * (any_value(e.number) - 1)
            / any_value(e.kept * (e.kept - 1)) AS error
    FROM ends AS e
    JOIN ranked AS r ON e.side = r.side AND e.subject = r.subject AND e.statistic = r.statistic
    GROUP BY e.side, e.subject, e.statistic
),
known AS (
    SELECT
        s.side, s.subject, s.statistic, s.flows, s.roots, s.reached, s.loss_affected, s.ambiguous,
        s.is_cut, s.units, s.is_enough, c.is_log, c.number, c.kept, c.centre, c.error,
        c.spread_percent,
        round(CASE WHEN c.is_log THEN exp(c.centre) ELSE c.centre END)::BIGINT AS value_ns
    FROM of_side AS s
    LEFT JOIN centre AS c ON s.side = c.side AND s.subject = c.subject AND s.statistic = c.statistic
),
paired AS (
    SELECT
        coalesce(a.subject, b.subject) AS subject,
        coalesce(a.statistic, b.statistic) AS statistic,
        a.value_ns AS a_ns, b.value_ns AS b_ns,
        coalesce(a.is_log, b.is_log) AS is_log,
        coalesce(a.number, 0) AS a_count,
        coalesce(b.number, 0) AS b_count,
        a.spread_percent AS a_spread_percent, b.spread_percent AS b_spread_percent,
        coalesce(a.flows, 0) AS a_flows,
        coalesce(b.flows, 0) AS b_flows,
        a.reached / nullif(a.roots, 0) AS a_share,
        b.reached / nullif(b.roots, 0) AS b_share,
        a.loss_affected AS a_loss_affected, b.loss_affected AS b_loss_affected,
        a.ambiguous AS a_ambiguous, b.ambiguous AS b_ambiguous,
        coalesce(a.is_cut, false) OR coalesce(b.is_cut, false) AS is_cut,
        b.centre - a.centre AS difference,
        sqrt(a.error + b.error) AS error,
        -- Welch and Satterthwaite.
        pow(a.error + b.error, 2)
            / nullif(pow(a.error, 2) / (a.kept - 1) + pow(b.error, 2) / (b.kept - 1), 0) AS freedom,
        CASE
            WHEN a.number IS NULL AND b.number IS NULL THEN 'too few values'
            WHEN b.number IS NULL THEN 'only in A'
            WHEN a.number IS NULL THEN 'only in B'
            WHEN coalesce(a.statistic, b.statistic) = 'max' THEN 'not estimated'
            WHEN least(a.units, b.units) < $least_units THEN 'too few runs'
            WHEN NOT a.is_enough OR NOT b.is_enough OR least(a.number, b.number) < $least_units
                THEN 'too few values'
        END AS reason
    FROM (SELECT * FROM known WHERE side = 'a') AS a
    FULL JOIN (SELECT * FROM known WHERE side = 'b') AS b
        ON a.subject = b.subject AND a.statistic = b.statistic
),
-- Student's t for the degrees of freedom, by the expansion of Cornish and Fisher.
judged AS (
    SELECT
        *,
        coalesce(error * (
            $z
            + (pow($z, 3) + $z) / (4 * freedom)
            + (5 * pow($z, 5) + 16 * pow($z, 3) + 3 * $z) / (96 * pow(freedom, 2))
            + (3 * pow($z, 7) + 19 * pow($z, 5) + 17 * pow($z, 3) - 15 * $z)
                / (384 * pow(freedom, 3))
            + (79 * pow($z, 9) + 776 * pow($z, 7) + 1482 * pow($z, 5) - 1920 * pow($z, 3)
                - 945 * $z) / (92160 * pow(freedom, 4))
        ), 0) AS off
    FROM paired
),
bounded AS (
    SELECT
        *,
        CASE
            WHEN is_log THEN 100 * (exp(difference - off) - 1)
            WHEN a_ns > 0 THEN 100 * (difference - off) / a_ns
        END AS low,
        CASE
            WHEN is_log THEN 100 * (exp(difference + off) - 1)
            WHEN a_ns > 0 THEN 100 * (difference + off) / a_ns
        END AS high
    FROM judged
)
SELECT
    statistic, a_ns, b_ns,
    CASE WHEN a_ns > 0 THEN round(100.0 * (b_ns - a_ns) / a_ns, 3) END AS change_percent,
    CASE WHEN reason IS NULL THEN round(low, 3) END AS low_percent,
    CASE WHEN reason IS NULL THEN round(high, 3) END AS high_percent,
    CASE
        WHEN reason IS NOT NULL THEN reason
        WHEN difference - off <= 0 AND difference + off >= 0 THEN 'no difference shown'
        WHEN abs(b_ns - a_ns) < $at_least * abs(a_ns) THEN 'about equal'
        WHEN difference - off > 0 THEN 'B is longer'
        ELSE 'B is shorter'
    END AS verdict,
    round(a_spread_percent, 2) AS a_spread_percent,
    round(b_spread_percent, 2) AS b_spread_percent,
    b_ns - a_ns AS difference_ns,
    CASE
        WHEN reason IS NULL AND is_log THEN round(a_ns * low / 100)
        WHEN reason IS NULL THEN round(difference - off)
    END::BIGINT AS low_ns,
    CASE
        WHEN reason IS NULL AND is_log THEN round(a_ns * high / 100)
        WHEN reason IS NULL THEN round(difference + off)
    END::BIGINT AS high_ns,
    a_count, b_count, a_flows, b_flows,
    round(a_share, 4) AS a_share,
    round(b_share, 4) AS b_share,
    a_loss_affected, b_loss_affected, a_ambiguous, b_ambiguous, is_cut, subject
FROM bounded
ORDER BY
    subject, list_position(['median', 'mean', 'p95', 'p99', 'max'], statistic)
