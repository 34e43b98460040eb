-- description: The number of the tenth of a second that a moment is in (of nanoseconds, with digits
--     in groups of three). Where only a few messages are asked for, what is in the same tenth is
--     read one by one. Everywhere else one row stands for all of a tenth. Its length changes no
--     answer. It only decides how many rows are left: a recording has far fewer tenths of a second
--     than messages, and each has few.
CREATE OR REPLACE MACRO derive.tenth_of_second(at_ns) AS at_ns // 100_000_000
