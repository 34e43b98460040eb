-- description: Timers and topics that stop until the end of the run, that begin late, or that pause
--     for much longer than they usually do. Pauses in which a trace has a gap are left out, and so
--     are those as long as chance makes them where single ones are left out now and then.
-- grain: one row per series and kind
-- param: series_values, settled
-- column: run_id
-- column: kind VARCHAR  'stop', 'begin' or 'gap'
-- column: what VARCHAR  'timer', 'topic' or 'take'
-- column: series_id
-- column: at_ns BIGINT [epoch ns]  Begin of the first silence; of 'begin' the end of it
-- column: usual DOUBLE  Median time from one to the next, in ns
-- column: longest_ns BIGINT [ns]  Longest silence
-- column: count BIGINT  Pauses; of 'stop' and 'begin' what is missing in the silence
-- column: times BIGINT[][]  Begin and end of each, epoch ns
CREATE OR REPLACE MACRO main.value_pause(series_values, settled) AS TABLE
WITH usual AS (
    SELECT
        run_id, what, series_id,
        median(value) AS median_ns,
        quantile_cont(value, 0.95) AS p95_ns,
        max(value) AS longest_ns,
        count(value) AS count,
        min(at_ns) AS first_ns,
        max(at_ns) AS last_ns
    FROM query_table(series_values)
    WHERE what IN ('timer', 'topic', 'take')
    GROUP BY run_id, what, series_id
    HAVING count(value) >= 10
),
-- How often some are left out, as a share; once may be for any reason.
omitted AS (
    SELECT
        u.what, u.series_id,
        (count(*) - 1) / any_value(u.count) AS share
    FROM usual AS u
    JOIN query_table(series_values) AS v ON u.what = v.what AND u.series_id = v.series_id
    WHERE v.value > 1.5 * u.median_ns AND v.value <= 2 * u.p95_ns
    GROUP BY u.what, u.series_id
),
pause AS (
    SELECT
        v.run_id, v.what, v.series_id, u.median_ns,
        'gap' AS kind,
        v.at_ns - v.value::BIGINT AS from_ns,
        v.at_ns AS to_ns
    FROM query_table(series_values) AS v
    JOIN query_table(settled) AS s ON v.run_id = s.run_id
    JOIN usual AS u ON v.what = u.what AND v.series_id = u.series_id
    LEFT JOIN omitted AS o ON v.what = o.what AND v.series_id = o.series_id
    WHERE from_ns >= s.start_ns
        AND v.value > 2 * u.p95_ns AND v.value > u.median_ns + 50_000_000
        -- So many in a row are left out by chance in less than one of a thousand runs.
        AND u.count * coalesce(o.share, 0) ** (v.value / u.median_ns - 1) < 0.001
    UNION ALL
    SELECT u.run_id, u.what, u.series_id, u.median_ns, e.kind, e.from_ns, e.to_ns
    FROM usual AS u
    JOIN query_table(settled) AS s ON u.run_id = s.run_id
    CROSS JOIN LATERAL (
        VALUES ('stop', u.last_ns, s.end_ns), ('begin', s.start_ns, u.first_ns)
    ) AS e (kind, from_ns, to_ns)
    WHERE e.to_ns - e.from_ns > greatest(10 * u.p95_ns, 2 * u.longest_ns, 1_000_000_000)
)
SELECT
    p.run_id, p.kind, p.what, p.series_id,
    min(CASE WHEN p.kind = 'begin' THEN p.to_ns ELSE p.from_ns END) AS at_ns,
    any_value(p.median_ns) AS usual,
    max(p.to_ns - p.from_ns) AS longest_ns,
    CASE WHEN p.kind = 'gap' THEN count(*) ELSE any_value((p.to_ns - p.from_ns) // p.median_ns) END
        ::BIGINT AS count,
    list([p.from_ns, p.to_ns] ORDER BY p.from_ns) AS times
FROM pause AS p
WHERE NOT EXISTS (
    FROM main.gap AS g
    WHERE g.run_id = p.run_id
        AND g.start_ns < p.to_ns
        AND g.end_ns > p.from_ns
        AND (
            p.kind = 'gap'
            -- What is lost meanwhile does not hide all of a long silence.
            OR 2 * (least(g.end_ns, p.to_ns) - greatest(g.start_ns, p.from_ns))
                > p.to_ns - p.from_ns
        )
)
GROUP BY p.run_id, p.kind, p.what, p.series_id
