-- name: main.clock
-- description: Clocks and how their times are corrected. Times in the other views are
--     corrected.
-- grain: one row per clock: hosts of one clock need no synchronisation
-- column: clock_id BIGINT  Identity of the clock
-- column: run_id BIGINT  Run that the row belongs to
-- column: uuid VARCHAR  UUID of the clock (LTTng: boot identity)
-- column: offset_ns BIGINT [ns]  Added to a time of this clock to correct it
-- column: drift_ppb BIGINT [1e-9]  Added per elapsed time since reference_ns
-- column: reference_ns BIGINT [epoch ns]  Moment at which the correction is offset_ns alone
-- column: uncertainty_ns BIGINT [ns]  Bound of the error of the correction
-- column: method VARCHAR  'none', 'messages', 'packets' or 'file'
-- needs: store.clock
SELECT
    self.clock_id,
    self.run_id,
    self.uuid,
    self.offset_ns,
    self.drift_ppb,
    self.reference_ns,
    self.uncertainty_ns,
    self.method
FROM store.clock AS self
