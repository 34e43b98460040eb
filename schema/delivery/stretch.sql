-- name: derive.stretch
-- kind: macro
-- description: The stretch of time that a moment is in, where only those of few stretches have to
--     be looked at one by one. Its length decides nothing else: with a tenth of a second, a
--     recording has few stretches beside its messages, and a stretch few messages.
CREATE OR REPLACE MACRO derive.stretch(at_ns) AS at_ns // 100_000_000
