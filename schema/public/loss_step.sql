-- description: Moments from which a larger or smaller share of messages is lost. The messages of a
--     subscription are split where two shares explain what was lost best, each part once more. Of
--     these moments those count at which two shares explain the parts beside it far better than
--     one, and better than losses that come together do by chance.
-- grain: one row per change
-- param: series_values
-- column: run_id
-- column: series_id
-- column: at_ns BIGINT [epoch ns]  The first message behind it
-- column: before DOUBLE  Share that was lost before, from the change before on
-- column: after DOUBLE  Share that was lost behind it, until the next change
CREATE OR REPLACE MACRO main.loss_step(series_values) AS TABLE
WITH RECURSIVE message AS MATERIALIZED (
    SELECT
        run_id, series_id, at_ns,
        row_number() OVER in_time AS number,
        sum(value) OVER in_time - value AS lost
    FROM query_table(series_values)
    WHERE what = 'loss'
    WINDOW in_time AS (PARTITION BY series_id ORDER BY at_ns ROWS UNBOUNDED PRECEDING)
    QUALIFY sum(value) OVER (PARTITION BY series_id) > 0
),
-- By how much the losses of ten messages differ from those of the next ten, in place of a variance
-- of messages that each are lost by chance.
ten AS (
    SELECT
        series_id,
        lead(lost) OVER of_ten - lost AS lost,
        lost - lag(lost) OVER of_ten AS lost_before
    FROM message
    WHERE number % 10 = 1
    WINDOW of_ten AS (PARTITION BY series_id ORDER BY number)
),
chance AS (
    SELECT
        series_id,
        10 * count(*) AS messages,
        greatest(
            1, avg((lost - lost_before) ** 2) / (20 * avg(lost / 10) * (1 - avg(lost / 10)))
        ) AS excess
    FROM ten
    GROUP BY series_id
),
part (series_id, first, last) AS (
    SELECT
        series_id,
        1,
        max(number)
    FROM message
    GROUP BY series_id
    UNION ALL
    SELECT
        series_id,
        unnest([first, split]),
        unnest([split, last])
    FROM (
        SELECT
            p.series_id, p.first, p.last, c.excess,
            m.number AS split,
            main.loss_likelihood(m.lost - f.lost, m.number - f.number)
            + main.loss_likelihood(l.lost - m.lost, l.number - m.number)
            - main.loss_likelihood(l.lost - f.lost, l.number - f.number) AS score
        FROM part AS p
        JOIN message AS f ON p.series_id = f.series_id AND p.first = f.number
        JOIN message AS l ON p.series_id = l.series_id AND p.last = l.number
        JOIN message AS m
            ON p.series_id = m.series_id AND m.number BETWEEN p.first + 10 AND p.last - 10
        JOIN chance AS c ON p.series_id = c.series_id
        QUALIFY row_number() OVER (
            PARTITION BY p.series_id, p.first ORDER BY score DESC, m.number
        ) = 1
    )
    WHERE score > 5 * excess
),
change AS (
    SELECT
        m.run_id, m.series_id, m.at_ns,
        m.lost - lag(m.lost) OVER of_changes AS lost_before,
        m.number - lag(m.number) OVER of_changes AS messages_before,
        lead(m.lost) OVER of_changes - m.lost AS lost_after,
        lead(m.number) OVER of_changes - m.number AS messages_after
    FROM message AS m
    JOIN (
        SELECT
            series_id,
            first AS number
        FROM part
        UNION
        SELECT
            series_id,
            last
        FROM part
    ) AS p ON m.series_id = p.series_id AND m.number = p.number
    WINDOW of_changes AS (PARTITION BY m.series_id ORDER BY m.number)
)
SELECT
    c.run_id, c.series_id, c.at_ns,
    c.lost_before / c.messages_before AS before,
    c.lost_after / c.messages_after AS after
FROM change AS c
JOIN chance AS x ON c.series_id = x.series_id
WHERE abs(after - before) > 0.05
    -- What is over soon is no other share, nor is what begins in the last 16th known to last.
    AND least(c.messages_before, c.messages_after) > x.messages / 16
    AND main.loss_likelihood(c.lost_before, c.messages_before)
    + main.loss_likelihood(c.lost_after, c.messages_after)
    - main.loss_likelihood(
        c.lost_before + c.lost_after, c.messages_before + c.messages_after
    ) > 10 * x.excess
