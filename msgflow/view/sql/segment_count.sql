-- description: Number of bars in a window, which decides whether they are drawn one by one.
-- grain: one row per window
-- column: count BIGINT  Bars
SELECT count(*) AS count FROM segment ORDER BY count
