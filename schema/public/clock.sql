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
-- column: uncertainty_ns BIGINT [ns]  Bound of the error of the correction at reference_ns
-- column: method VARCHAR  'none', 'messages', 'packets' or 'file'
-- column: drift_uncertainty_ppb BIGINT [1e-9]  What the bound grows by per time elapsed since
--     reference_ns or before it; NULL: the bound holds throughout, or is not known
-- column: reference_clock_id BIGINT  Clock whose times its times become: those of clocks with the
--     same one can be compared; NULL: as recorded
-- needs: store.clock
SELECT
    self.clock_id,
    self.run_id,
    self.uuid,
    self.offset_ns,
    self.drift_ppb,
    self.reference_ns,
    self.uncertainty_ns,
    self.method,
    self.drift_uncertainty_ppb,
    self.reference_clock_id
FROM store.clock AS self
