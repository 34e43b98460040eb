-- description: By how much a value has to change at least: a millisecond, two messages that wait, a
--     fifth of a CPU.
-- param: what VARCHAR  As in main.series_value
CREATE OR REPLACE MACRO main.least_change(what) AS
CASE what WHEN 'queue' THEN 1.5 WHEN 'CPU use' THEN 0.2 ELSE 1_000_000 END
