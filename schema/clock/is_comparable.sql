-- description: Whether times of two clocks can be compared: they are one, or one of the two was
--     brought to the other's time. Both are rows of derive.process_clock; false without `other`.
CREATE OR REPLACE MACRO derive.is_comparable(clock, other) AS
other.clock_id IS NOT NULL
AND (clock.clock_id = other.clock_id OR clock.method <> 'none' OR other.method <> 'none')
