-- description: A number of things in words: '1 message', '2 messages'.
CREATE OR REPLACE MACRO derive.counted(number, thing) AS
printf('%d %s%s', number::BIGINT, thing, CASE WHEN number = 1 THEN '' ELSE 's' END)
