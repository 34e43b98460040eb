-- name: main.clock
-- description: Clocks and how their times are corrected. Times in the other views are corrected
--     already.
-- grain: one row per clock: hosts of one clock need no synchronisation
-- column: clock_id BIGINT  Identity of the clock
-- column: run_id BIGINT  Run that the row belongs to
-- column: uuid VARCHAR  UUID of the clock (LTTng: boot identity)
-- column: offset_ns BIGINT [ns]  Added to a time of this clock to correct it
-- column: drift_ppb BIGINT [1e-9]  Added per unit of time since reference_ns
-- column: reference_ns BIGINT [epoch ns]  Moment at which the correction is offset_ns alone
-- column: uncertainty_ns BIGINT [ns]  Bound of the error of the correction at reference_ns
-- column: method VARCHAR  'none', 'messages', 'packets' or 'file'
-- column: drift_uncertainty_ppb BIGINT [1e-9]  Growth of the error bound per unit of time from
--     reference_ns; NULL: the bound holds throughout, or is not known
-- column: reference_clock_id BIGINT  Clock that this one is corrected to: times of clocks with the
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
