#pragma once
#include <map>
#include <string>

// SHA-256 of the files of bytes_test.cpp, for each instruction set. Scene and fields were recorded at commit
// 07c747b; all else anew with each change that was meant to change it: owners at last where Muon takes its
// steps on the smaller square product, logits of preset fast where informed detection counts the extractor's
// evidence. AVX-512 is not recorded.
inline const std::map<std::string, std::string> kBytesV2{
    {"code baked field", "45939742eceb32348e211e100dffcb0e89bb4306a78d3522bfd7281dd2b9a5b7"},
    {"code logits", "9613e54e8692e34788c1420773b95ac1f73cad031192077e2866490bda867c3e"},
    {"code owner", "f99657dd5c4003e08bb9c1a59b12d55b95c3015c7633c9884fd3bb6ed1a81019"},
    {"code renders", "d0bca072caacf18a15df2011528728fca35746a11ee89388767de5176b1fdce3"},
    {"fast baked field", "27c63b6fe694fb258ad215144f84dc417d2a54351f061efff9b512b7df32bedd"},
    {"fast logits", "8f6e0ac90dc68d74ac8e6d2b511d7c292c81bf11ad3c3c4068dc0353dc0ae2cb"},
    {"fast owner", "65fd6b163d3d7024463c8ce8753505c0879f78f05a7150f8ee571fadadd804cc"},
    {"fast renders", "ce84596ccd3d348d119c53c57cbe7c064b4ce9d738dd09d55d5efa7d5dd3b8b8"},
    {"hash field", "7169f1e7a7340da7cd7253b251b0cd4a79ddbae0180376de07068fb54e49625e"},
    {"mlp field", "7b33409f716c7056416cecc68cb45c617c9aca7da414de414f01d9eeff7cdb82"},
    {"paper baked field", "b4dea3d03359535da48642d20f2312ae6beb7fc4ff1081164267ea6703b4e4ce"},
    {"paper logits", "56e424adb296950876ab8f3e014143aa29f7599de504457f2c42197769474182"},
    {"paper owner", "b8926d037f1fd3343043356a136d0770357a56cbaa48fe8a8fe78dfd79c96059"},
    {"paper renders", "55266355752c4130cddab01038d2832c572a2b8fbf917944c6595f1ec4451938"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
inline const std::map<std::string, std::string> kBytesV3{
    {"code baked field", "81ba31a821e86c15ca4d7a69de1fa8dff47c5c4318b647ae74d3f32643a10477"},
    {"code logits", "b7049f28eb2e8e376b347b03d92a0fa7173d5e0513d05f67df108f1c278ea262"},
    {"code owner", "3692fd4b983cc8994de735edba9b3f9f25d2e416c22d5f7a59e0e7a70eec9c69"},
    {"code renders", "a5f6f7610d3dde3d4744590c2ef9f553cc8866fdfa796d814676b5d6f7948a43"},
    {"fast baked field", "af3c247a732a6a0cd2b5b8e9e68e738362b29cab115466fcb1026e2aeabcff15"},
    {"fast logits", "a12a9b804711a856e89462509d7e011e8e338077894be0e430fc095312c2b0b4"},
    {"fast owner", "23c111a4ace685ae0539bcdf034d11ee6282ef90fe958c9c160cd56d4a61d172"},
    {"fast renders", "98e6bbc8b57e790ffb2b0180c23758711182e177f2b22bec0f90a97680446b64"},
    {"hash field", "ddb8c16b2d62994a59ed8aa4ae932d923e75564baf99a3cbcda6591352018d07"},
    {"mlp field", "75b9aa11ccbf62dada9278d143ad378beee4521b95c4db7fe9702982666dee32"},
    {"paper baked field", "728767dd51e88775479458408af23acb00743d323833c000240af1c89ada5e3d"},
    {"paper logits", "56e424adb296950876ab8f3e014143aa29f7599de504457f2c42197769474182"},
    {"paper owner", "9021d5ef50e65e879ede954cac2c95ac2ab6714ed1f8d0f3f042d14c9f12cdf4"},
    {"paper renders", "69489ad545e972d162043ff66bb02731b10c7f02530ad977ee8f1da317c9a1e0"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
