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
-- param: at_least
-- param: least_units BIGINT  Fewest runs of either side for an interval
-- column: statistic
-- column: a_ns BIGINT [ns]  Its value in a typical run of side A
-- column: b_ns BIGINT [ns]  Its value in a typical run of side B
-- column: change_percent
-- column: low_percent DOUBLE  Lower end of the confidence interval of the change
-- column: high_percent DOUBLE  Its upper end
-- column: verdict VARCHAR  'B is longer' or 'B is shorter' where both ends have one sign, or 'about
--     equal' if the difference is less than at_least; else 'no difference shown'; 'too few runs',
--     'too few values' (in too many of the runs) or 'not estimated' (maximum), 'only in A' or 'only
--     in B'
-- column: a_spread_percent DOUBLE  Width of the middle half of the runs of A, in percent
-- column: b_spread_percent DOUBLE  Width of the middle half of the runs of B, in percent
-- column: difference_ns, low_ns, high_ns
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
    SELECT
        side, subject, unit, run,
        count(*) FILTER (is_enough) AS depth
    FROM measured
    WHERE value_ns IS NOT NULL
    GROUP BY side, subject, unit, run
),
allowing AS (
    SELECT
        r.side, r.subject, w.depth,
        count(DISTINCT r.unit) FILTER (WHERE r.depth >= w.depth) AS units,
        count(DISTINCT r.unit) FILTER (WHERE r.depth > 0) AS whole
    FROM of_run AS r
    JOIN (SELECT DISTINCT subject, depth FROM of_run WHERE depth > 0) AS w
        ON r.subject = w.subject
    GROUP BY r.side, r.subject, w.depth
),
wanted AS (
    SELECT
        subject,
        max(depth) AS depth
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
        side, subject, statistic,
        sum(number)::BIGINT AS flows,
        sum(roots) AS roots,
        sum(reached) AS reached,
        sum(loss_affected)::BIGINT AS loss_affected,
        sum(ambiguous)::BIGINT AS ambiguous,
        bool_or(is_cut) AS is_cut,
        count(DISTINCT unit) FILTER (WHERE value_ns IS NOT NULL) AS units,
        coalesce(bool_and(is_enough) FILTER (WHERE counted.run IS NOT NULL), false) AS is_enough
    FROM measured
    LEFT JOIN counted USING (side, subject, run)
    GROUP BY side, subject, statistic
),
unit AS (
    SELECT
        side, unit, subject, statistic,
        median(value_ns) AS value_ns
    FROM measured
    JOIN counted USING (side, subject, run)
    GROUP BY side, unit, subject, statistic
),
scaled AS (
    SELECT
        side, subject, statistic,
        min(value_ns) OVER (PARTITION BY subject) > 0 AS is_log,
        CASE WHEN is_log THEN ln(value_ns) ELSE value_ns END AS x
    FROM unit
),
listed AS (
    SELECT
        side, subject, statistic,
        any_value(is_log) AS is_log,
        list(x ORDER BY x) AS every,
        len(every) AS number,
        every[number // 5 + 1:number - number // 5] AS inner_part,
        len(inner_part) AS kept,
        list_avg(inner_part) AS centre,
        quantile_cont(x, 0.75) - quantile_cont(x, 0.25) AS spread
    FROM scaled
    GROUP BY side, subject, statistic
),
centre AS (
    SELECT
        side, subject, statistic, is_log, number, kept, centre,
        CASE WHEN is_log THEN 100 * (exp(spread) - 1) ELSE 100 * spread / abs(centre) END
            AS spread_percent,
        -- How far the trimmed mean may be off, squared.
        list_var_samp(list_transform(
            every, lambda x: greatest(inner_part[1], least(inner_part[-1], x))
        )) * (number - 1) / (kept * (kept - 1)) AS error
    FROM listed
),
known AS (
    SELECT
        *,
        round(CASE WHEN is_log THEN exp(centre) ELSE centre END)::BIGINT AS value_ns
    FROM of_side
    LEFT JOIN centre USING (side, subject, statistic)
),
paired AS (
    SELECT
        a, b,
        coalesce(a.is_log, b.is_log) AS is_log,
        b.centre - a.centre AS difference,
        sqrt(a.error + b.error) AS error,
        -- Welch and Satterthwaite.
        pow(a.error + b.error, 2)
            / nullif(pow(a.error, 2) / (a.kept - 1) + pow(b.error, 2) / (b.kept - 1), 0) AS freedom,
        CASE
            WHEN a.number IS NULL AND b.number IS NULL THEN 'too few values'
            WHEN b.number IS NULL THEN 'only in A'
            WHEN a.number IS NULL THEN 'only in B'
            WHEN a.statistic = 'max' THEN 'not estimated'
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
            WHEN a.value_ns > 0 THEN 100 * (difference - off) / a.value_ns
        END AS low,
        CASE
            WHEN is_log THEN 100 * (exp(difference + off) - 1)
            WHEN a.value_ns > 0 THEN 100 * (difference + off) / a.value_ns
        END AS high
    FROM judged
)
SELECT
    coalesce(a.statistic, b.statistic) AS statistic,
    a.value_ns AS a_ns,
    b.value_ns AS b_ns,
    CASE WHEN a_ns > 0 THEN round(100.0 * (b_ns - a_ns) / a_ns, 3) END AS change_percent,
    CASE WHEN reason IS NULL THEN round(low, 3) END AS low_percent,
    CASE WHEN reason IS NULL THEN round(high, 3) END AS high_percent,
    CASE
        WHEN reason IS NOT NULL THEN reason
        WHEN abs(difference) <= off THEN 'no difference shown'
        WHEN abs(b_ns - a_ns) < $at_least * abs(a_ns) THEN 'about equal'
        WHEN difference > 0 THEN 'B is longer'
        ELSE 'B is shorter'
    END AS verdict,
    round(a.spread_percent, 2) AS a_spread_percent,
    round(b.spread_percent, 2) AS b_spread_percent,
    b_ns - a_ns AS difference_ns,
    CASE
        WHEN reason IS NULL AND is_log THEN round(a_ns * low / 100)
        WHEN reason IS NULL THEN round(difference - off)
    END::BIGINT AS low_ns,
    CASE
        WHEN reason IS NULL AND is_log THEN round(a_ns * high / 100)
        WHEN reason IS NULL THEN round(difference + off)
    END::BIGINT AS high_ns,
    coalesce(a.number, 0) AS a_count,
    coalesce(b.number, 0) AS b_count,
    coalesce(a.flows, 0) AS a_flows,
    coalesce(b.flows, 0) AS b_flows,
    round(a.reached / nullif(a.roots, 0), 4) AS a_share,
    round(b.reached / nullif(b.roots, 0), 4) AS b_share,
    a.loss_affected AS a_loss_affected,
    b.loss_affected AS b_loss_affected,
    a.ambiguous AS a_ambiguous,
    b.ambiguous AS b_ambiguous,
    coalesce(a.is_cut, false) OR coalesce(b.is_cut, false) AS is_cut,
    coalesce(a.subject, b.subject) AS subject
FROM bounded
ORDER BY
    subject, list_position(['median', 'mean', 'p95', 'p99', 'max'], statistic)
