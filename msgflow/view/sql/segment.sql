-- name: segment
-- description: What the timeline draws as a bar, on the common time axis, of one run, as far as it
--     overlaps the window.
-- grain: one row per bar
-- kind: inline
-- column: row_key BIGINT  Row of the timeline, see row.sql
-- column: kind UTINYINT  As in bar.sql and call.sql
-- column: id BIGINT  Identity of the thing within its kind
-- column: start_ns BIGINT [epoch ns]  Begin
-- column: end_ns BIGINT [epoch ns]  End; the begin where the end was not seen
-- column: flags UTINYINT  As in bar.sql
SELECT row_key, kind, id, start_ns, end_ns, flags
FROM (
    SELECT
        b.row_key, b.kind, b.id,
        derive.corrected_ns(
            b.recorded_ns, c.offset_ns, c.drift_ppb, c.reference_ns
        ) AS start_ns,
        derive.corrected_ns(
            b.recorded_end_ns, c.offset_ns, c.drift_ppb, c.reference_ns
        ) AS end_ns,
        b.flags
    FROM bar AS b
    JOIN derive.process_clock AS c ON b.process_id = c.process_id
    WHERE b.run_id = $run
        AND b.recorded_ns < $recorded_before_ns
        AND b.recorded_end_ns >= $recorded_from_ns
    UNION ALL
    SELECT row_key, kind, id, start_ns, end_ns, flags
    FROM call
    WHERE run_id = $run
)
WHERE start_ns < $end_ns AND end_ns >= $start_ns
