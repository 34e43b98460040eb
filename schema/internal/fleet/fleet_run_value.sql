-- description: Statistics of the latency of every path in every run. Reads `flow` and `e2e_latency`
--     of a lake, and `sided`: the runs (run), the side of each (side, 'a' or 'b') and what it is a
--     sample of (unit): itself, or the robot that made it, say.
-- grain: one row per run, path and statistic; paths of one text in a run count together
-- reads: e2e_latency, flow, sided
-- param: case VARCHAR  'first' or 'last' arrival of each root, 'newest' root of each arrival, or
--     'every_pair'
WITH cut AS (SELECT run, bool_or(is_cut) AS is_cut FROM e2e_latency GROUP BY run),
measured AS (
    SELECT
        s.side, s.unit, f.run, f.path AS subject,
        count(value_ns) AS number,
        quantile_disc(value_ns, [0.5, 0.95, 0.99]) AS quantiles,
        avg(value_ns) AS mean_ns,
        max(value_ns) AS max_ns,
        count(*) FILTER (is_root) AS roots,
        count(*) FILTER (is_root AND f.status = 'reached') AS reached,
        count(*) FILTER (is_root AND f.is_loss_affected) AS loss_affected,
        count(value_ns) FILTER (f.is_ambiguous) AS ambiguous
    FROM (
        SELECT
            run, path, status, is_loss_affected, is_ambiguous,
            is_first IS NOT false
            AND status NOT IN ('not_connected', 'cut_by_recording') AS is_root,
            CASE
                WHEN status <> 'reached' THEN NULL
                WHEN $case = 'first' AND NOT is_first THEN NULL
                WHEN $case = 'last' AND NOT is_last THEN NULL
                WHEN $case = 'newest' AND NOT is_newest THEN NULL
                ELSE latency_ns
            END AS value_ns
        FROM flow
    ) AS f
    JOIN sided AS s ON f.run = s.run
    GROUP BY s.side, s.unit, f.run, f.path
),
value AS (
    SELECT
        *,
        unnest(['median', 'mean', 'p95', 'p99', 'max']) AS statistic,
        unnest([0.5, 0.5, 0.95, 0.99, 0.5]) AS quantile,
        unnest([
            quantiles[1], round(mean_ns)::BIGINT, quantiles[2], quantiles[3], max_ns
        ]) AS value_ns
    FROM measured
)
SELECT
    v.side, v.unit, v.run, v.subject, v.statistic, v.value_ns,
    v.number >= 20 AND v.number * (1 - v.quantile) >= 5 - 1e-9 AS is_enough,
    v.number, v.roots, v.reached, v.loss_affected, v.ambiguous,
    coalesce(c.is_cut, false) AS is_cut
FROM value AS v
LEFT JOIN cut AS c ON v.run = c.run
ORDER BY v.subject, v.side, v.unit, v.run, list_position(
    ['median', 'mean', 'p95', 'p99', 'max'], v.statistic
)
