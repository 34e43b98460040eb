-- description: Statistics of the latency of every path in every run. Reads `flow` and `e2e_latency`
--     of a lake, and `sided`: the runs (run), the side of each (side, 'a' or 'b') and what it is a
--     sample of (unit): itself, or the robot that made it, say.
-- grain: one row per run, path and statistic; paths of one text in a run count together
-- reads: e2e_latency, flow, sided
-- param: case VARCHAR  'first' or 'last' arrival of each root, 'newest' root of each arrival, or
--     'every_pair'
WITH cut AS (
    SELECT
        run,
        bool_or(is_cut) AS is_cut
    FROM e2e_latency
    GROUP BY run
),
measured AS (
    SELECT
        s.side, s.unit, f.run,
        f.path AS subject,
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
)
SELECT
    m.side, m.unit, m.run, m.subject,
    unnest(['median', 'mean', 'p95', 'p99', 'max']) AS statistic,
    unnest([
        m.quantiles[1], round(m.mean_ns)::BIGINT, m.quantiles[2], m.quantiles[3], m.max_ns
    ]) AS value_ns,
    -- Five values beyond a quantile, and twenty in all.
    m.number >= unnest([20, 20, 5 / 0.05, 5 / 0.01, 20]) AS is_enough,
    m.number, m.roots, m.reached, m.loss_affected, m.ambiguous,
    coalesce(c.is_cut, false) AS is_cut
FROM measured AS m
LEFT JOIN cut AS c ON m.run = c.run
ORDER BY m.subject, m.side, m.unit, m.run, list_position(
    ['median', 'mean', 'p95', 'p99', 'max'], statistic
)
