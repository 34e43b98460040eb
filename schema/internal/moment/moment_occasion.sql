-- title: What began or happened around a moment
-- description: Within a second of it.
-- grain: one row per occasion
-- reads: series
-- param: at_ns BIGINT  The moment, epoch ns
-- column: at_ns BIGINT [epoch ns]  When
-- column: sentence VARCHAR  What happened
SELECT at_ns, sentence
FROM main.occasion($runs, 'series')
WHERE at_ns BETWEEN $at_ns - 1_000_000_000 AND $at_ns + 1_000_000_000
ORDER BY at_ns, sentence
