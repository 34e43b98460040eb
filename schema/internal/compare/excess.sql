-- description: What of a comparison (`compared`) is worse on side B than conditions (`condition`)
--     allow. The measured values decide; whether their difference may be chance is said of each. A
--     maximum is one value of each side: a condition on it means that. The reason is NULL where
--     side A is below 0, as of clocks that are apart: there is no percentage of it.
-- grain: one row per condition and path, callback or topic that exceeds it
-- reads: compared, condition
WITH measured AS (
    SELECT
        c.place, c.text,
        c.statistic = 'share' AS is_share,
        c.is_relative, c.allowed,
        r.place AS row_place,
        r.subject, r.verdict, r.a_ns, r.b_ns, r.a_share, r.b_share,
        r.b_ns - r.a_ns AS more_ns,
        -- Shares have four digits.
        round(100 * (r.a_share - r.b_share), 2) AS points,
        format('{:.6g} ms', r.a_ns / 1e6) AS a_text,
        format('{:.6g} ms', r.b_ns / 1e6) AS b_text
    FROM condition AS c
    JOIN (
        SELECT
            *,
            row_number() OVER () AS place
        FROM compared
    ) AS r
        ON r.statistic = if(c.statistic = 'share', 'median', c.statistic)
),
judged AS (
    SELECT
        place, row_place, text, subject, verdict, a_text,
        CASE
            WHEN is_share AND b_share IS NULL THEN 'has nothing in B that could arrive'
            WHEN is_share THEN format(
                '{:.4g} points less ({:.4g} % to {:.4g} %)', points, 100 * a_share, 100 * b_share
            )
            WHEN b_ns IS NULL THEN 'has no value in B'
            WHEN NOT is_relative THEN format('{:.6g} ms more', more_ns / 1e6)
            WHEN a_ns = 0 THEN b_text || ', and 0 ms in A'
            WHEN a_ns > 0
                THEN format('{:.4g} % more ({} to {})', 100e0 * more_ns / a_ns, a_text, b_text)
        END AS reason,
        CASE WHEN NOT is_share AND b_ns IS NOT NULL THEN CASE verdict
            WHEN 'no difference shown' THEN '; it may be chance'
            WHEN 'about equal' THEN '; less than --at-least'
            WHEN 'too few values' THEN '; too few values to exclude chance'
            WHEN 'too few independent values'
                THEN '; too few independent values to exclude chance'
            WHEN 'too few runs' THEN '; too few runs to exclude chance'
            WHEN 'not estimated' THEN '; one value of each, it may be chance'
        END END AS chance
    FROM measured
    WHERE CASE
        WHEN is_share THEN a_share IS NOT NULL AND coalesce(points > allowed, true)
        WHEN a_ns IS NULL THEN false
        WHEN NOT is_relative THEN coalesce(more_ns > allowed, true)
        ELSE a_ns < 0 OR coalesce(100e0 * more_ns > allowed * a_ns, true)
    END
)
SELECT
    text AS condition,
    subject,
    reason || coalesce(chance, '') AS reason,
    a_text,
    chance IS NOT NULL AND verdict IN (
        'no difference shown', 'too few values', 'too few independent values', 'too few runs'
    ) AS may_be_chance
FROM judged
ORDER BY place, row_place
