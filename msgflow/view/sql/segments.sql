-- description: What the timeline draws in a window. With a bin, bars shorter than it are counted
--     per row, kind and bin, and only longer ones come one by one.
-- grain: one row per bar, or per row of the timeline, kind and bin with shorter ones
-- param: bin_ns BIGINT = NULL  Length of a bin; NULL: every bar comes one by one
-- column: row_key
-- column: kind UTINYINT  Kind of the bar
-- column: id BIGINT  Identity of the thing; NULL: several in one bin
-- column: start_at BIGINT [ns since origin]  Begin of the bar, or of the bin
-- column: length BIGINT [ns]  Length of the bar, or of the bin
-- column: flags UTINYINT  As in segment.sql
-- column: count BIGINT  Bars in the bin; 1 for a bar
-- column: busy
SELECT
    row_key, kind, id,
    start_ns - $origin_ns AS start_at,
    end_ns - start_ns AS length,
    flags,
    1::BIGINT AS count,
    end_ns - start_ns AS busy
FROM segment
WHERE $bin_ns IS NULL OR end_ns - start_ns >= $bin_ns
UNION ALL
SELECT
    row_key, kind, NULL,
    $bin_ns * ((start_ns - $origin_ns) // $bin_ns) AS start_at,
    $bin_ns,
    bit_or(flags),
    count(*),
    sum(end_ns - start_ns)::BIGINT
FROM segment
WHERE end_ns - start_ns < $bin_ns
GROUP BY row_key, kind, (start_ns - $origin_ns) // $bin_ns
ORDER BY row_key, start_at, kind, id
