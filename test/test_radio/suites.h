#pragma once

void runReceiverTests();
void runRadioLinkTests();
void runChannelMapTests();
