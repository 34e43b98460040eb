-- description: Answers count some callbacks as one: a node may make many timers of one function
--     and period, such as a one-shot timer for each event. Every other callback counts alone.
-- grain: one row per callback object
-- column: callback_id, run_id
-- column: alike_id BIGINT  The first of those like it
-- column: objects BIGINT  How many there are of them, with itself
SELECT
    c.callback_id, c.run_id,
    min(c.callback_id) OVER alike AS alike_id,
    count(*) OVER alike AS objects
FROM store.callback AS c
LEFT JOIN store.timer AS t ON c.timer_id = t.timer_id
WINDOW alike AS (
    PARTITION BY
        c.run_id, c.node_id, c.symbol, t.period_ns,
        CASE WHEN c.node_id IS NULL OR c.symbol IS NULL OR t.period_ns IS NULL
            THEN c.callback_id END
)
