-- description: How far times of several hosts can be compared, a sentence each.
-- grain: one row per run whose clocks are not synchronised, then per clock that is corrected
WITH known AS (
    SELECT
        clock_id,
        min(uncertainty_ns) AS least_ns,
        max(uncertainty_ns) AS greatest_ns
    FROM main.clock_uncertainty
    GROUP BY clock_id
),
note AS (
    SELECT
        g.run_id,
        0 AS clock_id,
        format(
            '{} has {} clocks that are not synchronised: times between their hosts are not '
            'comparable; msgflow clocks apply {}',
            if(len($runs) > 1, format('run {} ({})', any_value(r.name), g.run_id), 'the run'),
            count(*),
            if(bool_or(g.is_tried), 'FILE', 'messages')
        ) AS sentence
    FROM clock_group AS g
    JOIN main.run AS r ON g.run_id = r.run_id
    GROUP BY g.run_id
    HAVING count(*) > 1
    UNION ALL
    SELECT
        c.run_id,
        c.clock_id,
        concat(
            CASE WHEN len($runs) > 1 THEN format('run {} ({}): ', r.name, r.run_id) END,
            format('times between {} and {} ', of_reference.hosts, of_clock.hosts),
            coalesce(
                format(
                    'are known to ±{:.3f} ms at best and ±{:.3f} ms at worst',
                    coalesce(k.least_ns, c.uncertainty_ns) / 1e6,
                    coalesce(k.greatest_ns, c.uncertainty_ns) / 1e6
                ),
                'are off by as much as the file with their offsets is'
            ),
            '; msgflow clocks'
        )
    FROM main.clock AS c
    JOIN main.run AS r ON c.run_id = r.run_id
    JOIN clock_host AS of_clock ON c.clock_id = of_clock.clock_id
    JOIN clock_host AS of_reference ON c.reference_clock_id = of_reference.clock_id
    LEFT JOIN known AS k ON c.clock_id = k.clock_id
    WHERE list_contains($runs, c.run_id) AND c.reference_clock_id <> c.clock_id
)
SELECT sentence
FROM note
ORDER BY clock_id > 0, list_position($runs, run_id), clock_id
