-- description: Whether times of the hosts of a run can be compared, a sentence.
-- grain: one row per run
-- param: only_several BOOLEAN  Leave out runs with one clock
SELECT
    concat(
        CASE WHEN len($runs) > 1 THEN format('run {} ({}): ', any_value(r.name), g.run_id) END,
        CASE
            WHEN count(*) > 1 THEN format(
                'the clocks of {} are not synchronised: times between them cannot be compared; '
                'cure: msgflow clocks apply {}',
                string_agg(g.hosts, ' | ' ORDER BY g.first_clock_id),
                if(bool_or(g.is_tried), 'FILE', 'messages')
            )
            WHEN max(g.clocks) = 1
                THEN format('one clock ({}): all times can be compared', any_value(g.hosts))
            WHEN max(g.greatest_ms) IS NULL THEN format(
                'the clocks of {} are together, as far as the file with their offsets is right',
                any_value(g.hosts)
            )
            ELSE format(
                'the clocks of {} are together within ±{:.3f} ms',
                any_value(g.hosts), max(g.greatest_ms)
            )
        END
    ) AS sentence
FROM clock_group AS g
JOIN main.run AS r ON g.run_id = r.run_id
GROUP BY g.run_id
HAVING NOT $only_several OR count(*) > 1 OR max(g.clocks) > 1
ORDER BY list_position($runs, g.run_id)
