-- name: main.clock_uncertainty
-- description: How wrong the correction of a clock can be at most, at any time: at the moments
--     listed here by uncertainty_ns, between two of them by what the straight line between them
--     gives. Times of two clocks with the same reference can be compared to within the sum of both
--     bounds. The reference itself has no error and no rows.
-- grain: one row per clock and moment
-- column: run_id BIGINT  Run that the row belongs to
-- column: clock_id BIGINT  The clock
-- column: at_ns BIGINT [epoch ns]  Moment, as the clock showed it
-- column: uncertainty_ns BIGINT [ns]  Bound of the error of the correction at that moment
-- needs: store.clock_uncertainty
SELECT
    self.run_id,
    self.clock_id,
    self.at_ns,
    self.uncertainty_ns
FROM store.clock_uncertainty AS self
