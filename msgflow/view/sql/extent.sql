-- description: How long a piece of time is, where a window has `bins` of them.
-- grain: one row
-- kind: inline
-- column: width BIGINT [ns]  Length of a piece
SELECT ($end_ns - $start_ns) // $bins + 1 AS width
