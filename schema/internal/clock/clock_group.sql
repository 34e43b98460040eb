-- description: Clocks that are corrected to the same one. The bound of two clocks is the sum of
--     theirs, and that of the reference is 0.
-- grain: one row per clock that others are corrected to, or that stands alone
-- kind: inline
WITH known AS (
    SELECT
        clock_id,
        max(uncertainty_ns) AS greatest_ns
    FROM main.clock_uncertainty
    GROUP BY clock_id
),
bound AS (
    SELECT
        c.run_id, c.clock_id, n.hosts,
        derive.clock_group_id(c.clock_id, c.reference_clock_id) AS together,
        coalesce(k.greatest_ns, c.uncertainty_ns) AS bound_ns
    FROM main.clock AS c
    LEFT JOIN clock_host AS n ON c.clock_id = n.clock_id
    LEFT JOIN known AS k ON c.clock_id = k.clock_id
    WHERE list_contains($runs, c.run_id)
)
SELECT
    run_id,
    string_agg(hosts, ', ' ORDER BY clock_id) AS hosts,
    min(clock_id) AS first_clock_id,
    count(*) AS clocks,
    CASE WHEN bool_and(bound_ns IS NOT NULL) THEN list_sum(max(bound_ns, 2)) / 1e6 END
        AS greatest_ms,
    run_id IN (SELECT run_id FROM store.run WHERE clock_sync = 'messages') AS is_tried
FROM bound
GROUP BY run_id, together
