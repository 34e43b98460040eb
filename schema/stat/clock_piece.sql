-- name: derive.clock_piece
-- description: Bound of the error of the correction of a clock, as straight lines: it is
--     `uncertainty_ns` at `at_ns`, as the clock showed it, and grows by `growth` per time until the
--     next row.
-- grain: one row per clock and line
-- needs: store.clock_uncertainty
SELECT
    run_id, clock_id, at_ns, uncertainty_ns,
    coalesce(
        (lead(uncertainty_ns) OVER along - uncertainty_ns) / (lead(at_ns) OVER along - at_ns), 0
    ) AS growth
FROM store.clock_uncertainty
WINDOW along AS (PARTITION BY clock_id ORDER BY at_ns)
