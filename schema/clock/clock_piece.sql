-- description: The bound of the error of the correction of a clock, as straight lines. It is
--     `uncertainty_ns` at `at_ns`, as the clock showed it, and changes by `growth` per time from
--     `from_ns` until the next row. Outside the moments for which a bound is known, it grows as
--     fast as a clock can drift away from its correction.
-- grain: one row per clock and line
WITH bound AS (
    SELECT
        u.run_id, u.clock_id, u.at_ns, u.uncertainty_ns,
        derive.clock_drift_limit() + abs(c.drift_ppb) / 1e9 AS fastest
    FROM store.clock_uncertainty AS u
    JOIN store.clock AS c ON u.clock_id = c.clock_id
)
SELECT
    run_id, clock_id,
    at_ns AS from_ns,
    at_ns, uncertainty_ns,
    coalesce(
        (lead(uncertainty_ns) OVER along - uncertainty_ns) / (lead(at_ns) OVER along - at_ns),
        fastest
    ) AS growth
FROM bound
WINDOW along AS (PARTITION BY clock_id ORDER BY at_ns)
UNION ALL
SELECT
    run_id, clock_id, -9223372036854775808,
    min(at_ns),
    arg_min(uncertainty_ns, at_ns),
    -fastest
FROM bound
GROUP BY run_id, clock_id, fastest
