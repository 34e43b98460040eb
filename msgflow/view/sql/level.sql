-- description: What segments.sql gives for bins of some length, counted once for the whole run, put
--     together to longer bins.
-- grain: one row per bar, or per row of the timeline, kind and bin with shorter ones
-- reads: level
-- param: bin_ns BIGINT  Length of a bin, a multiple of that of the level
-- column: row_key
-- column: kind UTINYINT  Kind of the bar
-- column: id BIGINT  Identity of the thing; NULL: several in one bin
-- column: start_at BIGINT [ns since origin]  Begin of the bar, or of the bin
-- column: length BIGINT [ns]  Length of the bar, or of the bin
-- column: flags
-- column: count BIGINT  Bars in the bin; 1 for a bar
-- column: busy
SELECT row_key, kind, id, start_at, length, flags, count, busy
FROM level
WHERE run_id = $run
    AND start_at < $end_ns - $origin_ns AND start_at + length >= $start_ns - $origin_ns
    AND id IS NOT NULL AND length >= $bin_ns
UNION ALL
SELECT
    row_key, kind, NULL,
    $bin_ns * (start_at // $bin_ns),
    $bin_ns,
    bit_or(flags),
    sum(count)::BIGINT,
    sum(busy)::BIGINT
FROM level
WHERE run_id = $run
    AND start_at < $end_ns - $origin_ns AND start_at + length >= $start_ns - $origin_ns
    AND (id IS NULL OR length < $bin_ns)
GROUP BY row_key, kind, start_at // $bin_ns
ORDER BY row_key, start_at, kind, id
