-- description: The number of the stretch of time that a moment is in: a tenth of a second. Where
--     only a few messages are asked for, what is around them is read one by one. Everywhere else
--     one row stands for all of a stretch. The length changes no answer. It only decides how many
--     rows are left: a recording has far fewer stretches than messages, and a stretch has few.
CREATE OR REPLACE MACRO derive.stretch(at_ns) AS at_ns // 100_000_000
