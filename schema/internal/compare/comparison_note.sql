-- description: What the rows of a comparison of two runs (`compared`: of `main.comparison`) do not
--     show, a sentence each: what was lost, what is left out, what verdicts are said of.
-- grain: one row per sentence
-- reads: compared
-- param: run_a, run_b, what
WITH lost AS (
    SELECT
        run_id,
        coalesce(sum(discarded_event_count), 0)::BIGINT AS events
    FROM main.trace
    WHERE run_id IN ($run_a, $run_b)
    GROUP BY run_id
),
affected AS (
    SELECT
        'A' AS side,
        $run_a AS run_id,
        coalesce(sum(a_loss_affected), 0)::BIGINT AS number
    FROM compared
    WHERE statistic = 'median'
    UNION ALL
    SELECT
        'B', $run_b,
        coalesce(sum(b_loss_affected), 0)::BIGINT
    FROM compared
    WHERE statistic = 'median'
),
note AS (
    SELECT
        1 AS place,
        NULL AS side,
        'paths beyond the limits are left out; --max-paths and --max-depth raise them, --from and'
        ' --to choose' AS sentence
    WHERE EXISTS (FROM compared WHERE is_cut)
    UNION ALL
    SELECT
        2, a.side,
        format(
            'run {}, {} ({}), lost {} events: {} of its {} have a gap in their time, others may be'
            ' missing altogether',
            a.side, r.name, r.run_id, coalesce(l.events, 0), a.number,
            CASE $what
                WHEN 'callbacks' THEN 'callback instances' WHEN 'topics' THEN 'takes' ELSE 'flows'
            END
        )
    FROM affected AS a
    JOIN main.run AS r ON a.run_id = r.run_id
    LEFT JOIN lost AS l ON a.run_id = l.run_id
    WHERE a.number > 0 OR l.events > 0
    UNION ALL
    SELECT
        3, NULL,
        'values that follow each other are alike, so that they count as few independent ones:'
        ' longer recordings tell more; a_independent and b_independent of --wide say how many'
    WHERE EXISTS (FROM compared WHERE verdict = 'too few independent values')
    UNION ALL
    SELECT
        4, NULL,
        'longer and shorter are said of these two recordings; the same system started again'
        ' differs, too'
    WHERE EXISTS (FROM compared WHERE verdict IN ('B is longer', 'B is shorter'))
)
SELECT sentence
FROM note
ORDER BY place, side
