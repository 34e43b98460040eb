-- name: main.thread_break
-- description: Where the record of a thread breaks: events of the thread may be missing before
--     these moments. No executor state reaches across a break, and pairs of events that do are
--     marked.
-- grain: one row per gap in the record of a thread
-- column: run_id BIGINT  Run that the row belongs to
-- column: thread_id BIGINT  Thread whose events may be missing
-- column: resumed_ns BIGINT [epoch ns]  First event of the thread behind the gap
-- column: is_elsewhere BOOLEAN  Only other CPUs lost events, which the thread may have visited
--     meanwhile: pairs may reach across
-- needs: store.thread_break, store.thread, derive.corrected_ns, derive.process_clock
SELECT
    self.run_id,
    self.thread_id,
    derive.corrected_ns(self.resumed_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS resumed_ns,
    coalesce(self.is_elsewhere, false) AS is_elsewhere
FROM store.thread_break AS self
JOIN store.thread AS t ON self.thread_id = t.thread_id
JOIN derive.process_clock AS c ON t.process_id = c.process_id
