-- name: derive.stretch
-- kind: macro
-- description: The stretch of time that a moment is in. Moments of few stretches have to be looked
--     at one by one; of any other, one row stands for all. Its length decides nothing else: with a
--     tenth of a second, a recording has far fewer stretches than messages, and a stretch few of
--     them.
CREATE OR REPLACE MACRO derive.stretch(at_ns) AS at_ns // 100_000_000
