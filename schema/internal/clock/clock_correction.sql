-- description: Clocks that are corrected to another one, and how well that is known.
-- grain: one row per clock that is corrected
WITH known AS (
    SELECT clock_id, min(uncertainty_ns) AS least_ns, max(uncertainty_ns) AS greatest_ns
    FROM main.clock_uncertainty
    GROUP BY clock_id
)
SELECT
    c.run_id, r.hosts AS reference, n.hosts,
    coalesce(k.least_ns, c.uncertainty_ns) / 1e6 AS least_ms,
    coalesce(k.greatest_ns, c.uncertainty_ns) / 1e6 AS greatest_ms
FROM main.clock AS c
JOIN clock_host AS n ON c.clock_id = n.clock_id
JOIN clock_host AS r ON c.reference_clock_id = r.clock_id
LEFT JOIN known AS k ON c.clock_id = k.clock_id
WHERE list_contains($runs, c.run_id) AND c.reference_clock_id <> c.clock_id
ORDER BY c.clock_id
