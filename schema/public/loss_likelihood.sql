-- description: How likely so many losses are if each message is lost with their share: a logarithm.
-- param: lost BIGINT  Messages that were lost
-- param: messages BIGINT  Of so many
CREATE OR REPLACE MACRO main.loss_likelihood(lost, messages) AS
lost * ln(greatest(lost, 1) / messages)
+ (messages - lost) * ln(greatest(messages - lost, 1) / messages)
