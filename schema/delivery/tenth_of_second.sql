-- description: The number of the tenth of a second in which a moment lies (of nanoseconds, with
--     digits in groups of three). In tenths with a message that is asked for, each event is read;
--     any other tenth has one row in place of all its events. Another length would change no
--     answer, only how many rows are left.
CREATE OR REPLACE MACRO derive.tenth_of_second(at_ns) AS at_ns // 100_000_000
